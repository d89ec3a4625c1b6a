//! Containers whose tiles begin at multiples of what disks ask for, also when they are changed, joined or
//! rewritten.

use std::io::Cursor;
use std::ops::ControlFlow;

use pollster::block_on;
use vastex_core::{Description, LayerFormat, PagePos};

use crate::testing::textures::{aligned_bytes, container_bytes, image, memory, open, texels};
use crate::*;

const ALIGN: u32 = 4096;

/// Every tile in the file is aligned, and the file is sound.
#[track_caller]
fn check(bytes: Vec<u8>, align: u32) -> Container {
    assert_eq!(block_on(verify(memory(bytes.clone()), |_, _| {})).faults, []);
    let container = open(bytes);
    assert_eq!((container.align(), container.info().align), (align, align));
    let records = (0..container.index().records()).map(|n| container.index().record(n).unwrap());
    let offsets: Vec<u64> =
        records.filter(|r| r.codec != Codec::Constant).map(|r| r.section.extent.offset).collect();
    assert!(offsets.len() > 3 && offsets.iter().all(|offset| offset % u64::from(align) == 0), "{offsets:?}");
    container
}

fn description() -> Description {
    image(60, 50, 16, LayerFormat::R8)
}

#[test]
fn every_tile_begins_at_a_multiple() {
    let plain = open(container_bytes(&description(), Compression::Lz4, 5));
    for align in [4096, 16384, 1 << 16] {
        let container = check(aligned_bytes(&description(), Compression::Lz4, 5, align), align);
        for pos in description().geometry.pages() {
            let [ours, theirs] = [&container, &plain].map(|c| block_on(c.read(pos)).unwrap());
            assert_eq!(ours, theirs);
        }
    }
}

#[test]
fn other_multiples_are_refused() {
    for align in [0, 3, 512, 6000, 1 << 17] {
        let options = WriterOptions { align, ..WriterOptions::default() };
        let refused = ContainerWriter::new(Cursor::new(Vec::new()), "memory", description(), options);
        let error = refused.unwrap_err().to_string();
        assert!(error.contains(&align.to_string()) && error.contains("a power of two from 4096"), "{error}");
    }
}

#[test]
fn changing_and_rewriting_keep_the_alignment() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.vastex");
    std::fs::write(&path, aligned_bytes(&description(), Compression::Lz4, 5, ALIGN)).unwrap();
    for seed in [6, 7] {
        let mut update = ContainerUpdate::open(&path, false).unwrap();
        let pages = [PagePos::new_2d(0, 0, 0), PagePos::new_2d(0, 1, 1), description().geometry.tail_pos()];
        for pos in pages {
            let noise: Vec<u8> = texels(&description(), PagePos::new_2d(0, 9, seed), seed.into());
            let noise = noise.iter().enumerate().map(|(n, byte)| byte ^ ((n * n) >> 3) as u8 ^ pos.x as u8);
            let tile = EncodedTile::new(noise.collect(), &description(), Compression::None);
            update.replace(pos, tile).unwrap();
        }
        update.commit().unwrap();
        check(std::fs::read(&path).unwrap(), ALIGN);
    }
    reorder(&path, &path, false, |_, _| ControlFlow::Continue(())).unwrap();
    check(std::fs::read(&path).unwrap(), ALIGN);
}

/// A file that states an alignment and does not keep to it: direct reads would take other bytes, so verify
/// says so.
#[test]
fn a_tile_elsewhere_than_stated_is_reported() {
    let bytes = aligned_bytes(&description(), Compression::Lz4, 5, ALIGN);
    let number = |at: usize| u64::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
    let (description_at, len) = (number(32), number(40));
    // The alignment is the last section, its value the last four bytes.
    let mut lying = bytes.clone();
    lying[description_at + len - 4..][..4].copy_from_slice(&(1u32 << 16).to_le_bytes());
    let sum = crate::ground::hash::checksum(&lying[description_at..description_at + len]);
    for copy in [0, 512] {
        lying[copy + 48..][..8].copy_from_slice(&sum.to_le_bytes());
        let sum = crate::ground::hash::checksum(&lying[copy..copy + 88]);
        lying[copy + 88..][..8].copy_from_slice(&sum.to_le_bytes());
    }
    let faults = block_on(verify(memory(lying), |_, _| {})).faults;
    assert!(faults.iter().any(|fault| fault.fault.contains("a multiple of 65536 bytes")), "{faults:?}");
}

#[test]
fn files_without_alignment_are_what_they_were() {
    let bytes = container_bytes(&description(), Compression::Lz4, 5);
    let info = check(bytes.clone(), 1).info();
    // Header, description and index are there, and no gap.
    let gaps = aligned_bytes(&description(), Compression::Lz4, 5, ALIGN).len() - bytes.len();
    assert!(gaps as u64 > info.stored_tiles * 2000, "{gaps}");
}
