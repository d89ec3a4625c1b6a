//! What the tests of this crate share: textures of every kind, tiles to fill them, and containers in memory.

use std::io::Cursor;
use std::sync::Arc;

use bytes::Bytes;
use proptest::prelude::*;
use vastex_core::{AddressMode, Description, Dims, Geometry, GeometrySpec, Layer, LayerFormat, PagePos};

use crate::hash::seeded;
use crate::{Compression, Container, ContainerWriter, EncodedTile, MemoryStore, Store, WriterOptions};

/// An image of `width` by `height` texels with small pages.
pub(crate) fn image(width: u32, height: u32, page: u32, format: LayerFormat) -> Description {
    let spec = GeometrySpec { page, border: 1, ..GeometrySpec::image(width, height) };
    Description::one_layer(Geometry::new(spec).unwrap(), format)
}

/// Images and volumes of odd sizes, pages of 8 to 300 texels, all formats, one to three layers, all address modes.
pub(crate) fn any_description() -> impl Strategy<Value = Description> {
    let address = prop::sample::select(vec![AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror]);
    let formats = prop::collection::vec(prop::sample::select(&LayerFormat::ALL[..]), 1..4);
    let shape = (any::<bool>(), prop::array::uniform3(1u32..400), 8u32..=300, 1u32..=4);
    (shape, prop::array::uniform3(address), formats).prop_map(
        |((volume, size, page, border), address, formats)| {
            let spec = if volume {
                GeometrySpec {
                    dims: Dims::D3,
                    size: size.map(|n| n.div_ceil(10)),
                    page: 8 + page % 10,
                    border,
                    address,
                }
            } else {
                GeometrySpec { dims: Dims::D2, size: [size[0], size[1], 1], page, border, address }
            };
            let layers =
                formats.iter().enumerate().map(|(n, &format)| Layer { name: format!("layer {n}"), format });
            Description { geometry: Geometry::new(spec).unwrap(), layers: layers.collect() }
        },
    )
}

/// The texels of a page: noise, runs, one colour or what another page has, as `seed` and the page say.
pub(crate) fn texels(description: &Description, pos: PagePos, seed: u64) -> Vec<u8> {
    let key = [u32::from(pos.level), pos.x, pos.y, pos.z].map(u32::to_le_bytes).concat();
    let hash = seeded(seed, &key);
    let kind = hash % 5;
    let seed = if kind == 3 { seed } else { hash };
    let run = if kind == 0 { 1 } else { 50 };
    if kind == 4 {
        return Description::clone(description)
            .layers
            .iter()
            .flat_map(|l| {
                (hash as u32).to_le_bytes()[..l.format.texel_bytes()].repeat(tile_texels(description))
            })
            .collect();
    }
    (0..description.tile_bytes()).map(|n| seeded(seed, &(n as u64 / run).to_le_bytes()) as u8).collect()
}

fn tile_texels(description: &Description) -> usize {
    description.geometry.tile_texels() as usize
}

/// A whole container with those texels in every page.
pub(crate) fn container_bytes(description: &Description, compression: Compression, seed: u64) -> Vec<u8> {
    let out = Cursor::new(Vec::new());
    let options = WriterOptions { compression, ..WriterOptions::default() };
    let mut writer = ContainerWriter::new(out, "memory", description.clone(), options).unwrap();
    let mut pages: Vec<_> = description.geometry.pages().collect();
    pages.sort_by_key(|pos| (pos.level, pos.z, pos.y, pos.x));
    for pos in pages {
        let tile = EncodedTile::new(texels(description, pos, seed).into(), description, compression);
        writer.append(pos, tile).unwrap();
    }
    writer.complete().unwrap().0.into_inner()
}

/// A store of `bytes`.
pub(crate) fn memory(bytes: impl Into<Bytes>) -> Arc<dyn Store> {
    Arc::new(MemoryStore::new("memory", bytes))
}

/// The container in `bytes`.
pub(crate) fn open(bytes: impl Into<Bytes>) -> Container {
    pollster::block_on(Container::open(memory(bytes))).unwrap()
}
