//! The last step of a texture with insets: its tiles, compressed as they were asked for, on their way to the output.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use bytes::Bytes;
use rayon::prelude::*;
use vastex_core::{Description, Geometry, PagePos};
use vastex_tiles::{
    Container, ContainerWriter, EncodedTile, ReadError, ReorderError, TempFile, Tile, TileSource, Written,
    rewrite,
};

use super::Steps;
use crate::build::{BuildError, BuildOptions};
use crate::image::Notice;
use crate::progress::Progress;
use crate::texels::blocks::{self, Lost};
use crate::threads;
use crate::tile::tail::extend_levels;

/// Bytes of texels that are encoded side by side.
const BATCH_BYTES: usize = 8 << 20;

/// Writes the container at `unfinished`, no layer of which is compressed in blocks, as `texture`, along the curve. With each
/// layer comes what there is to say of what it lost.
pub(super) fn encode(
    unfinished: &Path,
    writer: ContainerWriter<TempFile>,
    texture: &Description,
    options: &BuildOptions,
    steps: &Steps<'_>,
) -> Result<(Written, Vec<Option<Notice>>), BuildError> {
    let container = Container::open_file(unfinished).map_err(|error| BuildError::Reorder(error.into()))?;
    let (source, name) = (container.description().clone(), container.name().to_string());
    let encoder = Encoder {
        texture,
        geometries: texture.layers.iter().map(|layer| texture.geometry.of_layer(layer.scale)).collect(),
        source: &source,
        options,
        negatives: texture.layers.iter().map(|_| false.into()).collect(),
    };
    let pool = threads::pool(options.threads)?;
    let make = |tiles: Vec<(PagePos, Tile)>| {
        let encoded = |(pos, tile): (PagePos, Tile)| {
            let texels = tile.decode(&source).map_err(|error| ReadError::Damaged {
                pos,
                place: name.clone(),
                fault: error.to_string(),
            })?;
            Ok((pos, encoder.tile(pos, texels)))
        };
        pool.install(|| tiles.into_par_iter().map(encoded).collect())
    };
    let at_once = BATCH_BYTES / source.tile_bytes().max(1);
    let written = rewrite(container, writer, at_once, make, |_, _| steps.advance(0, 0, 0));
    let written = written.map_err(|error| match error {
        ReorderError::Cancelled => BuildError::Cancelled,
        ReorderError::Output(error) => error.into(),
        error => BuildError::Reorder(error),
    })?;
    Ok((written, encoder.notices()))
}

/// What makes tiles of texels.
struct Encoder<'a> {
    texture: &'a Description,
    /// The texture's, as each layer sees it.
    geometries: Vec<Geometry>,
    source: &'a Description,
    options: &'a BuildOptions,
    /// Whether a layer had numbers that its blocks cannot hold.
    negatives: Vec<AtomicBool>,
}

impl Encoder<'_> {
    fn tile(&self, pos: PagePos, texels: Bytes) -> EncodedTile {
        let compression = self.options.compression;
        if self.texture.layers.iter().all(|layer| !layer.format.is_compressed()) {
            return EncodedTile::new(texels, self.texture, compression);
        }
        let mut bytes = Vec::with_capacity(self.texture.tile_bytes());
        for number in 0..self.texture.layers.len() {
            self.add_layer(number, pos, &texels[self.source.layer_range(number)], &mut bytes);
        }
        EncodedTile::new(bytes.into(), self.texture, compression)
    }

    fn add_layer(&self, number: usize, pos: PagePos, part: &[u8], bytes: &mut Vec<u8>) {
        let (format, geometry) = (self.texture.layers[number].format, &self.geometries[number]);
        if !format.is_compressed() {
            return bytes.extend_from_slice(part);
        }
        let mut tail = Vec::new();
        if geometry.is_tail(pos) {
            tail.extend_from_slice(part);
            extend_levels(geometry, format, &mut tail);
        }
        let part = if tail.is_empty() { part } else { &tail };
        let row_bytes = geometry.tile()[0] as usize * format.texel_bytes();
        let rows: Vec<&[u8]> = part.chunks_exact(row_bytes).collect();
        let Lost { negatives } = blocks::encode(format, self.options.quality, &rows, bytes);
        if negatives {
            self.negatives[number].store(true, Ordering::Relaxed);
        }
    }

    fn notices(&self) -> Vec<Option<Notice>> {
        let of_layer = |(number, layer): (usize, &vastex_core::Layer)| {
            self.negatives[number].load(Ordering::Relaxed).then_some(Notice::NegativesClamped(layer.format))
        };
        self.texture.layers.iter().enumerate().map(of_layer).collect()
    }
}
