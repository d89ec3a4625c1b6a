//! Containers of volumes: a texture for each channel and time, each read as it was written.

use std::io::Cursor;

use pollster::block_on;
use vastex_core::{Description, Geometry, GeometrySpec, LayerFormat, PagePos};

use crate::testing::textures::{open, texels};
use crate::*;

fn description() -> Description {
    let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::volume([21, 17, 9]) };
    Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R16)
}

fn volume() -> ContainerVolume {
    ContainerVolume { channels: 3, times: 2, values: 4, fill: [7; 8], about: "{}".into() }
}

/// What a page of a texture holds: the one at the origin is one value.
fn expected(description: &Description, texture: u64, pos: PagePos) -> Vec<u8> {
    match pos.level == 0 && pos.coords() == [0; 3] {
        true => vec![texture as u8; description.tile_bytes()],
        false => texels(description, pos, texture),
    }
}

/// A container whose textures differ.
fn container() -> Vec<u8> {
    let description = description();
    let options = WriterOptions { volume: Some(volume()), ..WriterOptions::default() };
    let mut writer =
        ContainerWriter::new(Cursor::new(Vec::new()), "memory", description.clone(), options).unwrap();
    for texture in 0..6 {
        for pos in description.geometry.pages() {
            let texels = expected(&description, texture, pos);
            let tile = EncodedTile::new(texels.into(), &description, Compression::Lz4);
            writer.append_to(texture, pos, tile).unwrap();
        }
    }
    let tile = EncodedTile::new(vec![0; description.tile_bytes()].into(), &description, Compression::Lz4);
    assert!(writer.append_to(6, description.geometry.tail_pos(), tile).is_err());
    writer.complete().unwrap().0.into_inner()
}

#[test]
fn every_texture_reads_as_it_was_written() {
    let container = open(container());
    let description = description();
    assert_eq!((container.volume(), &**container.description()), (Some(&volume()), &description));
    let pages: Vec<_> = description.geometry.pages().collect();
    for texture in 0..6 {
        for pos in &pages {
            let tile = block_on(container.read_of(texture, *pos)).unwrap();
            let read = tile.decode(&description).unwrap();
            assert_eq!(read, expected(&description, texture, *pos), "{texture} {pos}");
            let constant = container.constant_of(texture, *pos);
            assert!(constant.iter().all(|texel| read[..] == texel.repeat(read.len() / 2)), "{pos}");
            assert!(constant.is_some() || pos.coords() != [0; 3] || pos.level > 0, "{pos}");
        }
    }
    assert!(matches!(block_on(container.read_of(6, pages[0])), Err(ReadError::NoSuchTile { .. })));
    assert_eq!(container.constant_of(6, pages[0]), None);
    let info = container.info();
    assert_eq!((info.pages, info.tiles), (6 * pages.len() as u64, 6 * pages.len() as u64));
    assert_eq!(*info.tiles_by_level.last().unwrap(), 6);
    let verification = block_on(verify(container.store().clone(), |_, _| {}));
    assert_eq!(verification.faults, []);
}

#[test]
fn every_texture_needs_its_tail() {
    let description = description();
    let options = WriterOptions { volume: Some(volume()), ..WriterOptions::default() };
    let mut writer =
        ContainerWriter::new(Cursor::new(Vec::new()), "memory", description.clone(), options).unwrap();
    writer.write_tile(description.geometry.tail_pos(), &vec![1; description.tile_bytes()]).unwrap();
    assert!(matches!(writer.complete(), Err(WriteError::Incomplete { .. })));
}

#[cfg(not(target_family = "wasm"))]
#[test]
fn what_is_of_images_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("volume.vastex");
    std::fs::write(&path, container()).unwrap();
    assert!(Container::holds_volume(&path) && !Container::holds_volume(directory.path().join("none")));
    let reordered = reorder(&path, &directory.path().join("out.vastex"), false, |_, _| {
        std::ops::ControlFlow::Continue(())
    });
    assert!(reordered.unwrap_err().to_string().contains("is of a volume"));
    let update = ContainerUpdate::open(&path, false);
    assert!(update.is_err_and(|error| error.to_string().contains("is of a volume")));
}
