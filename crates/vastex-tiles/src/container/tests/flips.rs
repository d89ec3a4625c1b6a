//! Single bits flipped in containers of every kind: each is reported, none makes a reader panic or give other
//! texels.
//!
//! The suite takes a seeded sample; `VASTEX_FLIPS` says how many, for campaigns. `damage` flips every bit of
//! one file.

use std::sync::Arc;

use bytes::Bytes;
use pollster::block_on;
use vastex_core::{Description, Layer, LayerFormat, PagePos};

use crate::ground::hash::seeded;
use crate::testing::textures::{aligned_bytes, container_bytes, image, memory, open, texels};
use crate::*;

const SEED: u64 = 0x5eed;

/// A sound file, and the decoded tiles of each version of its content that a reader may find in it.
struct Sound {
    name: &'static str,
    bytes: Vec<u8>,
    versions: Vec<Vec<Bytes>>,
}

impl Sound {
    fn new(name: &'static str, bytes: Vec<u8>) -> Sound {
        let versions = vec![tiles(&open(bytes.clone())).map(|tile| tile.unwrap()).collect()];
        Sound { name, bytes, versions }
    }

    /// Changed in place: should its newest header copy be damaged, the version before is all there still.
    fn changed(name: &'static str, bytes: Vec<u8>) -> Sound {
        let old = Sound::new(name, bytes);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("changed.vastex");
        std::fs::write(&path, &old.bytes).unwrap();
        let mut update = ContainerUpdate::open(&path, false).unwrap();
        let description = update.container().description().clone();
        for pos in [PagePos::new_2d(0, 0, 0), PagePos::new_2d(0, 1, 1), description.geometry.tail_pos()] {
            let tile = texels(&description, pos, 77).iter().map(|byte| byte ^ 0x55).collect();
            update.replace(pos, EncodedTile::new(tile, &description, Compression::Lz4)).unwrap();
        }
        update.commit().unwrap();
        let new = Sound::new(name, std::fs::read(&path).unwrap());
        Sound { versions: [new.versions, old.versions].concat(), ..new }
    }
}

/// Every tile, decoded; or that it cannot be read.
fn tiles(container: &Container) -> impl Iterator<Item = Option<Bytes>> {
    let description: Arc<Description> = container.description().clone();
    let pages: Vec<PagePos> = description.geometry.pages().collect();
    pages.into_iter().map(move |pos| block_on(container.read(pos)).ok()?.decode(&description).ok())
}

fn sound_files() -> Vec<Sound> {
    let grey = image(36, 20, 8, LayerFormat::R8);
    let layers = [("height", LayerFormat::R16), ("color", LayerFormat::Rgba8Srgb), ("mask", LayerFormat::R8)];
    let layer = |(name, format): (&str, LayerFormat)| {
        let of_one = Description::one_layer(grey.geometry.clone(), format);
        Layer { name: name.into(), ..of_one.layers[0].clone() }
    };
    let several = Description { layers: layers.map(layer).to_vec(), ..grey.clone() };
    vec![
        Sound::new("raw", container_bytes(&grey, Compression::None, 1)),
        Sound::new("lz4", container_bytes(&grey, Compression::Lz4, 2)),
        Sound::new("zstd", container_bytes(&grey, Compression::Zstd(3), 3)),
        Sound::new("several layers", container_bytes(&several, Compression::Lz4, 4)),
        Sound::new("aligned", aligned_bytes(&grey, Compression::Zstd(1), 5, 4096)),
        Sound::changed("changed", container_bytes(&grey, Compression::Lz4, 6)),
        Sound::changed("changed, aligned", aligned_bytes(&several, Compression::None, 7, 4096)),
    ]
}

/// Reads everything of a file with one flipped bit; says what should not be.
fn fault_of(sound: &Sound, bytes: Vec<u8>) -> Result<(), &'static str> {
    if block_on(verify(memory(bytes.clone()), |_, _| {})).faults.is_empty() {
        return Err("verify reports nothing");
    }
    let Ok(container) = block_on(Container::open(memory(bytes))) else { return Ok(()) };
    container.info();
    let read: Vec<Option<Bytes>> = tiles(&container).collect();
    let is_of = |version: &Vec<Bytes>| {
        let mut pairs = read.iter().zip(version);
        read.len() == version.len()
            && pairs.all(|(read, sound)| read.as_ref().is_none_or(|read| read == sound))
    };
    if sound.versions.iter().any(is_of) { Ok(()) } else { Err("other texels are read") }
}

#[test]
fn a_flipped_bit_is_reported_and_never_seen_in_texels() {
    let count = std::env::var("VASTEX_FLIPS").map_or(1000, |count| count.parse().unwrap());
    let files = sound_files();
    for file in &files {
        assert_eq!(block_on(verify(memory(file.bytes.clone()), |_, _| {})).faults, [], "{}", file.name);
    }
    for flip in 0..count {
        let file = &files[flip % files.len()];
        let mut bytes = file.bytes.clone();
        let mut bit = seeded(SEED, &(flip as u64).to_le_bytes()) as usize % (bytes.len() * 8);
        // The zeros of gaps and headers would take most: every second flip goes to the next byte that says
        // something.
        if flip / files.len() % 2 == 1 {
            bit += bytes[bit / 8..].iter().position(|&byte| byte != 0).unwrap_or(0) * 8;
        }
        bytes[bit / 8] ^= 1 << (bit % 8);
        if let Err(fault) = fault_of(file, bytes) {
            panic!("flip {flip}: {}: bit {} of byte {}: {fault}", file.name, bit % 8, bit / 8);
        }
    }
}

#[test]
fn the_files_have_what_they_are_named_for() {
    for file in sound_files() {
        let container = open(file.bytes.clone());
        let info = container.info();
        assert!(info.constant_tiles > 0 && info.stored_tiles > 3, "{}: {info:?}", file.name);
        let changed = file.name.starts_with("changed");
        assert_eq!(container.index().superseded().unwrap().is_empty(), !changed, "{}", file.name);
    }
}
