//! Files that are cut, altered, made up or something else: an error that says what to do, and never a panic.

use pollster::block_on;
use proptest::prelude::*;
use vastex_core::LayerFormat;

use crate::container::format::layout::{HEADER_BYTES, HEADER_COPY_BYTES};
use crate::ground::hash::checksum;
use crate::testing::textures::{container_bytes, image, memory, open};
use crate::*;

/// About 3 KB with stored, shared and constant tiles of every codec that compresses them.
fn small() -> Vec<u8> {
    container_bytes(&image(20, 20, 8, LayerFormat::R8), Compression::Lz4, 11)
}

fn faults(bytes: Vec<u8>) -> Vec<Fault> {
    block_on(verify(memory(bytes), |_, _| {})).faults
}

fn refused(bytes: impl Into<bytes::Bytes>) -> ContainerError {
    block_on(Container::open(memory(bytes))).unwrap_err()
}

/// Reads whatever can be read; the point is that it returns.
fn read_all(bytes: Vec<u8>) {
    let Ok(container) = block_on(Container::open(memory(bytes.clone()))) else { return };
    container.info();
    for pos in container.description().clone().geometry.pages().take(100) {
        if let Ok(tile) = block_on(container.read(pos)) {
            let _ = tile.decode(container.description());
        }
    }
    faults(bytes);
}

#[test]
fn every_flipped_bit_is_found() {
    let sound = small();
    assert_eq!(faults(sound.clone()), []);
    let info = open(sound.clone()).info();
    assert!(info.constant_tiles > 0 && info.stored_tiles > 3, "{info:?}");
    for bit in 0..sound.len() * 8 {
        let mut bytes = sound.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(!faults(bytes).is_empty(), "bit {} of byte {} of {}", bit % 8, bit / 8, sound.len());
    }
}

#[test]
fn every_truncation_is_a_clean_error() {
    let sound = small();
    for len in 0..sound.len() {
        let error = refused(sound[..len].to_vec());
        assert!(matches!(error, ContainerError::Truncated { .. }), "{len} bytes: {error}");
        assert!(!faults(sound[..len].to_vec()).is_empty());
    }
}

#[test]
fn one_damaged_header_copy_is_survived_and_reported() {
    for copy in 0..2 {
        let mut bytes = small();
        bytes[copy * HEADER_COPY_BYTES as usize + 30] ^= 1;
        open(bytes.clone());
        let faults = faults(bytes);
        assert_eq!(faults.len(), 1);
        assert!(
            faults[0].place.starts_with(["header copy A at 0", "header copy B at 512"][copy]),
            "{faults:?}"
        );
    }
}

#[test]
fn every_damaged_tile_is_reported_and_the_others_are_read() {
    let bytes = container_bytes(&image(60, 60, 8, LayerFormat::R8), Compression::None, 11);
    let container = open(bytes.clone());
    let stored: Vec<_> = (0..container.index().records())
        .map(|n| container.index().record(n).unwrap())
        .filter(|record| record.codec != Codec::Constant)
        .collect();
    let mut damaged = bytes;
    for record in &stored[..3] {
        damaged[record.section.extent.offset as usize] ^= 1;
    }
    let faults = faults(damaged.clone());
    assert_eq!(faults.len(), 3, "{faults:?}");
    let container = open(damaged);
    let errors =
        container.description().geometry.pages().filter_map(|pos| block_on(container.read(pos)).err());
    let errors: Vec<_> = errors.map(|e| e.to_string()).collect();
    assert!(errors.len() >= 3 && errors.len() < stored.len(), "{errors:?}");
    assert!(errors.iter().all(|e| e.contains("memory: bytes ") && e.contains("copy it anew")), "{errors:?}");
}

#[test]
fn bytes_after_the_end_are_reported_but_read_past() {
    let mut bytes = small();
    bytes.extend([0; 10]);
    open(bytes.clone());
    let found = block_on(verify(memory(bytes), |_, _| {}));
    assert_eq!((&found.faults[..], found.leftover_bytes), (&[][..], 10));
}

#[test]
fn other_files_are_named_for_what_they_are() {
    let text = b"{ \"this is\": \"no container\" }\n".repeat(100);
    let cases: [(&[u8], &str, bool); 6] = [
        (&text, "(it is a text file)", false),
        (b"short", "(it is a text file)", false),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "(it is a PNG image)", true),
        (b"\xff\xd8\xff\xe0\0\x10JFIF", "(it is a JPEG image)", true),
        (b"II*\0\x08\0\0\0", "(it is a TIFF image)", true),
        (&[0; 5000], "(it is all zeros)", false),
    ];
    for (bytes, found, is_image) in cases {
        let error = refused(bytes.to_vec()).to_string();
        assert!(error.starts_with(&format!("memory: not a Vastex container {found}")), "{error}");
        assert_eq!(error.contains("vastex build"), is_image, "{error}");
    }
    assert!(matches!(refused(Vec::new()), ContainerError::Truncated { len: 0, .. }));
}

#[test]
fn files_that_cannot_be_read_are_named_with_the_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let error = Container::open_file(dir.path()).unwrap_err().to_string();
    assert!(error.contains("directory") && error.contains(&dir.path().display().to_string()), "{error}");
    let empty = dir.path().join("empty.vastex");
    std::fs::write(&empty, []).unwrap();
    assert!(Container::open_file(&empty).unwrap_err().to_string().contains("is empty"));
    assert!(Container::open_file(dir.path().join("none")).unwrap_err().to_string().contains("no such file"));
}

/// Changes the header and makes its checksum right again, as an attacker would.
fn forge_header(mut bytes: Vec<u8>, at: usize, value: u64) -> Vec<u8> {
    for copy in [0, HEADER_COPY_BYTES as usize] {
        bytes[copy + at..][..8].copy_from_slice(&value.to_le_bytes());
        let checksum = checksum(&bytes[copy..copy + 88]);
        bytes[copy + 88..][..8].copy_from_slice(&checksum.to_le_bytes());
    }
    bytes
}

/// Changes the index and makes its checksum and the header's right again.
fn forge_index(mut bytes: Vec<u8>, at: usize, value: &[u8]) -> Vec<u8> {
    let number = |at: usize| u64::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
    let (offset, len) = (number(56), number(64));
    bytes[offset + at % len..][..value.len().min(len - at % len)]
        .copy_from_slice(&value[..value.len().min(len - at % len)]);
    let checksum = checksum(&bytes[offset..offset + len]);
    forge_header(bytes, 72, checksum)
}

#[test]
fn a_newer_version_is_refused_with_the_remedy() {
    let mut bytes = small();
    for copy in [0, HEADER_COPY_BYTES as usize] {
        bytes[copy + 8] = 2;
    }
    let error = refused(bytes).to_string();
    assert!(error.contains("version 2") && error.contains("update it"), "{error}");
}

#[test]
fn headers_that_lie_under_a_right_checksum_are_refused() {
    let sound = small();
    for at in (24..88).step_by(8) {
        for lie in [0, 1, HEADER_BYTES - 1, sound.len() as u64 + 1, 1 << 40, 1 << 63, u64::MAX] {
            let bytes = forge_header(sound.clone(), at, lie);
            assert!(!faults(bytes.clone()).is_empty(), "{lie} at {at}");
            read_all(bytes);
        }
    }
}

/// A sparse file may be far longer than memory, so that a length within it is no promise.
#[test]
fn an_index_longer_than_memory_is_refused() {
    let (file_len_at, index_len_at) = (24, 64);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sparse.vastex");
    let sound = small();
    let index_at = u64::from_le_bytes(*sound[56..].first_chunk().unwrap());
    for len in [1u64 << 36, 1 << 43] {
        let bytes = forge_header(forge_header(sound.clone(), file_len_at, len), index_len_at, len - index_at);
        std::fs::write(&path, bytes).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_len(len).unwrap();
        let error = Container::open_file(&path).unwrap_err().to_string();
        assert!(error.contains("the index") && error.contains("at most"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn indices_that_lie_under_a_right_checksum_never_panic(at: usize, value in prop::collection::vec(any::<u8>(), 1..12)) {
        read_all(forge_index(small(), at, &value));
    }

    #[test]
    fn garbage_is_refused(bytes in prop::collection::vec(any::<u8>(), 0..3000)) {
        refused(bytes);
    }

    #[test]
    fn garbage_behind_the_magic_is_refused(bytes in prop::collection::vec(any::<u8>(), 0..3000)) {
        refused([&b"\x89VTX\r\n\x1a\n\x01\0\0\0\0\0\0\0"[..], &bytes].concat());
    }
}
