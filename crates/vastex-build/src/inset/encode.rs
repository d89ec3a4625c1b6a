//! The last step of a texture with insets: its tiles, compressed as they were asked for, on their way to the
//! output.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use rayon::prelude::*;
use vastex_core::{Description, Geometry, PagePos};
use vastex_tiles::{
    Container, ContainerWriter, EncodedTile, ReadError, ReorderError, TempFile, Tile, TileSource, Written,
    rewrite,
};

use super::Steps;
use crate::build::{BuildError, BuildOptions};
use crate::progress::Progress;
use crate::threads;
use crate::tile::tail::extend_levels;
use crate::tile::{Findings, TileEncoder};

/// Bytes of texels that are encoded side by side.
const BATCH_BYTES: usize = 8 << 20;

/// Writes the container at `unfinished`, no layer of which is compressed in blocks, as `texture`, along the
/// curve; says what was found.
pub(super) fn encode(
    unfinished: &Path,
    writer: ContainerWriter<TempFile>,
    texture: &Arc<Description>,
    options: &BuildOptions,
    steps: &Steps<'_>,
) -> Result<(Written, Findings), BuildError> {
    let container = Container::open_file(unfinished).map_err(|error| BuildError::Reorder(error.into()))?;
    let (source, name) = (container.description().clone(), container.name().to_string());
    let decoded = Decoded {
        encoder: TileEncoder::new(texture.clone(), options.compression, options.quality),
        geometries: texture.layers.iter().map(|layer| texture.geometry.of_layer(layer.scale)).collect(),
        source: &source,
    };
    let pool = threads::pool(options.threads)?;
    let make = |tiles: Vec<(PagePos, Tile)>| {
        let encoded = |(pos, tile): (PagePos, Tile)| {
            let texels = tile.decode(&source).map_err(|error| ReadError::Damaged {
                pos,
                place: name.clone(),
                fault: error.to_string(),
            })?;
            Ok((pos, decoded.tile(pos, &texels)))
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
    Ok((written, decoded.encoder.into_findings()))
}

/// Makes tiles of those of a texture without blocks.
struct Decoded<'a> {
    encoder: TileEncoder,
    /// The texture's, as each layer sees it.
    geometries: Vec<Geometry>,
    source: &'a Description,
}

impl Decoded<'_> {
    fn tile(&self, pos: PagePos, texels: &Bytes) -> EncodedTile {
        let layers = 0..self.geometries.len();
        if layers.clone().all(|number| !self.encoder.format(number).is_compressed()) {
            return self.encoder.tile(texels.clone());
        }
        let mut bytes = Vec::with_capacity(self.encoder.description().tile_bytes());
        layers.for_each(|number| {
            self.append(number, pos, &texels[self.source.layer_range(number)], &mut bytes);
        });
        self.encoder.tile(bytes)
    }

    fn append(&self, number: usize, pos: PagePos, texels: &[u8], bytes: &mut Vec<u8>) {
        let (format, geometry) = (self.encoder.format(number), &self.geometries[number]);
        let mut texels = Cow::Borrowed(texels);
        if geometry.is_tail(pos) && format.is_compressed() {
            extend_levels(geometry, format, texels.to_mut());
        }
        let row_bytes = geometry.tile()[0] as usize * format.texel_bytes();
        let rows: Vec<&[u8]> = texels.chunks_exact(row_bytes).collect();
        self.encoder.append(number, &rows, bytes);
    }
}
