//! The last step of a texture with insets: its tiles, compressed as they were asked for, on their way to the
//! output.

use std::path::Path;
use std::sync::Arc;

use vastex_core::{Description, PagePos};
use vastex_tiles::{Container, ContainerWriter, ReorderError, TempFile, Tile, TileSource, Written, rewrite};

use super::Steps;
use crate::build::{BuildError, BuildOptions};
use crate::progress::Progress;
use crate::threads;
use crate::tile::{Findings, Recoder, TileEncoder};

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
    let encoder = TileEncoder::new(texture.clone(), options.compression, options.quality);
    let recoder = Recoder::new(&encoder, &source);
    let pool = threads::pool(options.threads)?;
    let make = |tiles: Vec<(PagePos, Tile)>| {
        let encoded = |(pos, tile): (PagePos, Tile)| Ok((pos, recoder.recode(pos, &tile, &name)?));
        pool.install(|| threads::try_map(tiles, encoded))
    };
    let at_once = BATCH_BYTES / source.tile_bytes().max(1);
    let written = rewrite(container, writer, at_once, make, |_, _| steps.advance(0, 0, 0));
    let written = written.map_err(|error| match error {
        ReorderError::Cancelled => BuildError::Cancelled,
        ReorderError::Output(error) => error.into(),
        error => BuildError::Reorder(error),
    })?;
    Ok((written, encoder.into_findings()))
}
