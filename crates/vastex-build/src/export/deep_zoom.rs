//! Deep Zoom: every level of the texture, numbered from the coarsest, and a `.dzi` file.

use std::path::{Path, PathBuf};

use vastex_core::Geometry;

use super::plan::{LevelPlan, Plan, Reach, coarsest};
use super::{ExportError, ExportOptions, TileFormat, refuse};

/// Texels of a tile and of its overlap, as other tools have them.
const TILE: u32 = 254;
const OVERLAP: u32 = 1;
/// Texels that a tile may have, with both overlaps.
const MAX_SIDE: u32 = 8192;

pub(super) fn plan(
    geometry: &Geometry,
    options: &ExportOptions,
    format: TileFormat,
    name: &str,
) -> Result<Plan, ExportError> {
    let (tile, overlap) = (options.tile_size.unwrap_or(TILE), options.overlap.unwrap_or(OVERLAP));
    if tile == 0 || overlap > tile || tile.saturating_add(overlap.saturating_mul(2)) > MAX_SIDE {
        return refuse(&format!(
            "a tile of {tile} texels with an overlap of {overlap}: with both overlaps it has at most {MAX_SIDE}, and an overlap is no larger than its tile"
        ));
    }
    let files = PathBuf::from(format!("{name}_files"));
    let [width, height, _] = geometry.size();
    let coarsest = coarsest(geometry);
    let levels = (0..=coarsest).map(|level| level_plan(geometry, level, &files, tile, overlap)).collect();
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Image xmlns=\"http://schemas.microsoft.com/deepzoom/2008\" \
         Format=\"{}\" Overlap=\"{overlap}\" TileSize=\"{tile}\">\n  <Size Width=\"{width}\" Height=\"{height}\"/>\n\
         </Image>\n",
        format.extension()
    );
    let texts = vec![(PathBuf::from(format!("{name}.dzi")), text)];
    Ok(Plan { size: [width, height], levels, texts, notices: Vec::new() })
}

fn level_plan(geometry: &Geometry, level: u8, files: &Path, tile: u32, overlap: u32) -> LevelPlan {
    LevelPlan {
        directory: files.join((coarsest(geometry) - level).to_string()),
        ..LevelPlan::of_level(geometry, level, tile, Reach::Inner(overlap))
    }
}
