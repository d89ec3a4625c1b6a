//! A file that was changed in place, as the format allows: the newest whole version is read, every byte still
//! checked.

use pollster::block_on;
use vastex_core::LayerFormat;

use crate::container::format::header::Header;
use crate::container::format::layout::{HEADER_BYTES, HEADER_COPY_BYTES, Section};
use crate::testing::textures::{container_bytes, image, memory, open, texels};
use crate::*;

/// A file, and its second version: the same tiles under a new index. The old index is superseded.
fn changed() -> (Vec<u8>, Vec<u8>) {
    let first = container_bytes(&image(20, 20, 8, LayerFormat::R8), Compression::Lz4, 11);
    let old = open(first.clone());
    let extent = old.header().index.extent;
    let old_index = &first[extent.offset as usize..];
    let (counts, rest) = old_index.split_at(32);
    let (records, rest) = rest.split_at(24 * old.index().records() as usize);
    let mut index = counts.to_vec();
    index[8] = 1;
    index.extend(records);
    index.extend([extent.offset, extent.len, old.header().index.checksum].map(u64::to_le_bytes).concat());
    index.extend(rest);

    let mut bytes = first.clone();
    let index_offset = bytes.len() as u64;
    bytes.extend(&index);
    let header = Header {
        sequence: 2,
        file_len: bytes.len() as u64,
        index: Section::of(index_offset, &index),
        coarse_offset: index_offset,
        ..*old.header()
    };
    bytes[HEADER_COPY_BYTES as usize..HEADER_BYTES as usize].copy_from_slice(&header.encode());
    (first, bytes)
}

fn faults(bytes: Vec<u8>) -> Vec<Fault> {
    block_on(verify(memory(bytes), |_, _| {})).faults
}

#[test]
fn the_newest_version_is_read() {
    let (first, changed) = changed();
    let container = open(changed.clone());
    assert_eq!(container.header().sequence, 2);
    for pos in container.description().geometry.pages() {
        let tile = block_on(container.read(pos)).unwrap().decode(container.description()).unwrap();
        assert_eq!(tile, texels(container.description(), pos, 11));
    }
    assert_eq!(faults(changed.clone()), []);
    assert_ne!(first.len(), changed.len());
}

#[test]
fn every_flipped_bit_of_a_changed_file_is_found() {
    let (_, changed) = changed();
    for bit in 0..changed.len() * 8 {
        let mut bytes = changed.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(!faults(bytes).is_empty(), "bit {} of byte {} of {}", bit % 8, bit / 8, changed.len());
    }
}

#[test]
fn a_change_that_was_cut_off_leaves_the_version_before_it() {
    let (first, changed) = changed();
    for len in [first.len(), first.len() + 1, changed.len() - 1] {
        let cut = changed[..len].to_vec();
        assert_eq!(open(cut.clone()).header().sequence, 1);
        assert!(faults(cut).iter().any(|fault| fault.place.starts_with("header copy B")));
    }
    let mut unflipped = changed;
    unflipped[..HEADER_BYTES as usize].copy_from_slice(&first[..HEADER_BYTES as usize]);
    assert_eq!(open(unflipped).header().sequence, 1);
}

#[test]
fn where_the_newest_version_is_damaged_the_one_before_it_is_read() {
    let (first, changed) = changed();
    let newest = *open(changed.clone()).header();
    for at in [newest.index.extent.offset, newest.index.extent.offset + newest.index.extent.len - 1] {
        let mut bytes = changed.clone();
        bytes[at as usize] ^= 1;
        let container = open(bytes.clone());
        assert_eq!((container.header().sequence, container.header().file_len), (1, first.len() as u64));
        for pos in container.description().geometry.pages() {
            let tile = block_on(container.read(pos)).unwrap().decode(container.description()).unwrap();
            assert_eq!(tile, texels(container.description(), pos, 11));
        }
        // Whoever looks closer hears of it.
        let faults = faults(bytes);
        assert!(faults.iter().any(|fault| fault.fault.contains("cannot be opened")), "{faults:?}");
    }
    // Without a version before, and where that is damaged too, the damage is told.
    let mut only = first.clone();
    let at = only.len() - 1;
    only[at] ^= 1;
    let error = block_on(Container::open(memory(only))).map(drop).unwrap_err();
    assert!(error.to_string().contains("the index"), "{error}");
    let mut both = changed;
    let old = open(first).header().index.extent.offset as usize;
    (both[old], both[newest.index.extent.offset as usize]) =
        (!both[old], !both[newest.index.extent.offset as usize]);
    assert!(block_on(Container::open(memory(both))).is_err());
}
