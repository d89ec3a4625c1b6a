//! What the tests of this crate share: textures of every kind, tiles to fill them, and containers in memory.

use std::io::Cursor;
use std::sync::Arc;

use bytes::Bytes;
use proptest::prelude::*;
use vastex_core::{AddressMode, Description, Geometry, GeometrySpec, Layer, LayerFormat, PagePos};

use crate::ground::hash::seeded;
use crate::{Compression, Container, ContainerWriter, EncodedTile, MemoryStore, Store, WriterOptions};

/// An image of `width` by `height` texels with small pages.
pub(crate) fn image(width: u32, height: u32, page: u32, format: LayerFormat) -> Description {
    let spec = GeometrySpec { page, border: 1, ..GeometrySpec::image(width, height) };
    Description::one_layer(Geometry::new(spec).unwrap(), format)
}

/// Images and volumes of odd sizes, pages of 8 to 300 texels, all formats, one to three layers of any
/// resolution, all address modes.
pub(crate) fn any_description() -> impl Strategy<Value = Description> {
    let address = prop::sample::select(vec![
        AddressMode::Clamp,
        AddressMode::Wrap,
        AddressMode::Mirror,
        AddressMode::Border,
    ]);
    let layer = (prop::sample::select(&LayerFormat::ALL[..]), prop::sample::select(vec![1, 2, 4]));
    let layers = prop::collection::vec(layer, 1..4);
    let shape = (any::<bool>(), prop::array::uniform3(1u32..400), 8u32..=300, 1u32..=4);
    (shape, prop::array::uniform3(address), layers).prop_map(
        |((volume, size, page, border), address, layers)| {
            let layers = layers.into_iter().enumerate().map(|(n, (format, scale))| {
                let format = if volume { format.decoded() } else { format };
                Layer { scale, ..Layer::new(format!("layer {n}"), format) }
            });
            let layers: Vec<_> = layers.collect();
            let tail_align = Description::tail_align(&layers);
            // Whole blocks of every layer: 16 texels suit all; where nothing asks for them, any size is
            // tried.
            let unit = layers.iter().map(|layer| layer.scale * layer.format.block_side()).max().unwrap_or(1);
            let border = if unit == 1 { border } else { unit };
            let page = (if volume { 8 + page % 10 } else { page }).next_multiple_of(unit).max(2 * border);
            let spec = GeometrySpec {
                page,
                border,
                address,
                tail_align,
                ..match volume {
                    true => GeometrySpec::volume(size.map(|n| n.div_ceil(10))),
                    false => GeometrySpec::image(size[0], size[1]),
                }
            };
            let description = Description::new(Geometry::new(spec).unwrap(), layers);
            assert_eq!(description.check(), Ok(()));
            description
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
                let block = u128::from(hash).to_le_bytes();
                block[..l.format.block_bytes()].repeat(description.layer_blocks(l) as usize)
            })
            .collect();
    }
    (0..description.tile_bytes()).map(|n| seeded(seed, &(n as u64 / run).to_le_bytes()) as u8).collect()
}

/// A whole container with those texels in every page.
pub(crate) fn container_bytes(description: &Description, compression: Compression, seed: u64) -> Vec<u8> {
    aligned_bytes(description, compression, seed, 1)
}

/// A container with tiles that begin at multiples of `align`.
pub(crate) fn aligned_bytes(
    description: &Description,
    compression: Compression,
    seed: u64,
    align: u32,
) -> Vec<u8> {
    let out = Cursor::new(Vec::new());
    let options = WriterOptions { compression, align, ..WriterOptions::default() };
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
