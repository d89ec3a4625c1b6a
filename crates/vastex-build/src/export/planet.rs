//! Planet tiles, as Gaia Sky and Celestia read them: one tree for both, with what describes it to each.
//!
//! Level `l` has `2 * 2^l` columns and `2^l` rows of square tiles. A texture of exactly such a size keeps its
//! texels; any other is resampled, each level from the texture's next finer one. A part of a planet fills the
//! tiles from a given column and row on, and of coarser levels those that it covers wholly.

use std::path::PathBuf;

use vastex_core::Geometry;

use super::plan::{LevelPlan, Plan, Reach};
use super::{ExportError, ExportOptions, Layout, TileFormat, refuse};
use crate::image::Notice;

/// Texels of a tile, where the texture has so many.
const TILE: u32 = 512;
/// Texels per side of a tile that each program takes.
const GAIA_SKY_TILES: std::ops::RangeInclusive<u32> = 4..=1024;
const CELESTIA_TILES: std::ops::RangeInclusive<u32> = 64..=4096;
/// The finest level that each program takes.
const GAIA_SKY_FINEST: u32 = 14;
const CELESTIA_FINEST: u32 = 12;

/// The grid of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Tree {
    /// Texels per side of a file, and of the border within it.
    side: u32,
    border: u32,
    finest: u32,
}

impl Tree {
    fn payload(self) -> u32 {
        self.side - 2 * self.border
    }

    fn size(self, level: u32) -> [u64; 2] {
        [u64::from(self.payload()) << (level + 1), u64::from(self.payload()) << level]
    }
}

pub(super) fn plan(
    geometry: &Geometry,
    options: &ExportOptions,
    format: TileFormat,
    name: &str,
) -> Result<Plan, ExportError> {
    let tree = tree(geometry, options)?;
    let mut plan = match options.first_tile {
        None => whole(geometry, tree),
        Some(first) => part(geometry, tree, first)?,
    };
    plan.texts = texts(options.layout, tree, format, name);
    Ok(plan)
}

/// Tile size, border and finest level, as asked for or as the texture suggests.
fn tree(geometry: &Geometry, options: &ExportOptions) -> Result<Tree, ExportError> {
    let [width, height, _] = geometry.size();
    let (sides, most, program) = match options.layout {
        Layout::Celestia => (CELESTIA_TILES, CELESTIA_FINEST, "Celestia"),
        _ => (GAIA_SKY_TILES, GAIA_SKY_FINEST, "Gaia Sky"),
    };
    let natural = 1 << height.clamp(64, TILE).ilog2();
    let side: u32 = options.tile_size.unwrap_or(natural);
    if !side.is_power_of_two() || !sides.contains(&side) {
        let (low, high) = (sides.start(), sides.end());
        return refuse(&format!(
            "a tile of {side} texels: {program} takes powers of two from {low} to {high}"
        ));
    }
    let border = options.overlap.unwrap_or(0);
    if border > u32::from(options.layout == Layout::GaiaSky) {
        return refuse(&format!("an overlap of {border}: Gaia Sky's tiles can have 1, Celestia's have none"));
    }
    let tree = Tree { side, border, finest: 0 };
    let holds = |level: &u32| {
        let [columns, rows] = tree.size(*level);
        columns >= u64::from(width) && rows >= u64::from(height)
    };
    let finest = options.finest_level.or((0..=CELESTIA_FINEST).find(holds)).unwrap_or(CELESTIA_FINEST);
    if finest > most {
        return refuse(&format!("a finest level of {finest}: {program} reads levels 0 to {most}"));
    }
    if tree.size(finest)[0] > 1 << 31 {
        return refuse(&format!(
            "a finest level of {finest} with tiles of {side}: that is more than 2^31 texels"
        ));
    }
    Ok(Tree { finest, ..tree })
}

/// The whole planet, resampled where it must be.
fn whole(geometry: &Geometry, tree: Tree) -> Plan {
    let [width, height, _] = geometry.size();
    let size = tree.size(tree.finest).map(|n| n as u32);
    let levels = (0..=tree.finest).rev().map(|number| {
        let size = tree.size(number).map(|n| n as u32);
        let level = level_for(geometry, size);
        let [stored_width, stored_height, _] = geometry.level(level).size;
        LevelPlan {
            directory: PathBuf::from(format!("level{number}")),
            prefix: "tx_".into(),
            level,
            stored: [stored_width, stored_height],
            size,
            columns: 0..2 << number,
            rows: 0..1 << number,
            origin: [0; 2],
            step: tree.payload(),
            reach: Reach::Border(tree.border),
            wraps: true,
            // Both programs show an ancestor instead, and need the roots for that.
            may_lack_tiles: number > 0,
        }
    });
    let levels = levels.collect();
    let exact = size == [width, height];
    let notices = (!exact).then_some(Notice::ResampledToGrid { from: [width, height], to: size });
    Plan { size, levels, texts: Vec::new(), notices: notices.into_iter().collect() }
}

/// The coarsest level with at least so many texels along both axes, or the finest.
fn level_for(geometry: &Geometry, size: [u32; 2]) -> u8 {
    let is_enough = |level: &u8| {
        let stored = geometry.level(*level).size;
        stored[0] >= size[0] && stored[1] >= size[1]
    };
    (0..=geometry.coarsest()).rev().find(is_enough).unwrap_or(0)
}

/// A part of a planet, whose first tile of the finest level has column and row `first`.
fn part(geometry: &Geometry, tree: Tree, first: [u32; 2]) -> Result<Plan, ExportError> {
    let [width, height, _] = geometry.size();
    let (size, step) = ([width, height], tree.payload());
    if size.iter().any(|n| n % step != 0) {
        return refuse(&format!(
            "a part of {width}x{height} texels is not made of whole tiles of {step}; cut it so, or choose another tile size"
        ));
    }
    let grid = [2u32 << tree.finest, 1 << tree.finest];
    let end = [0, 1].map(|axis| u64::from(first[axis]) + u64::from(size[axis] / step));
    if (0..2).any(|axis| end[axis] > u64::from(grid[axis])) {
        return refuse(&format!(
            "a part from column {} and row {} on ends at column {}, row {}, but level {} has {} columns and {} rows; give its finest level",
            first[0], first[1], end[0], end[1], tree.finest, grid[0], grid[1]
        ));
    }
    let mut plan = Plan { size, ..Plan::default() };
    let is_whole_planet = (0..2).all(|axis| first[axis] == 0 && end[axis] == u64::from(grid[axis]));
    plan.notices.extend((tree.border > 0 && !is_whole_planet).then_some(Notice::PartBorders));
    for up in 0..=tree.finest.min(geometry.coarsest().into()) {
        let covered = [0, 1].map(|axis| first[axis].div_ceil(1 << up)..(end[axis] >> up) as u32);
        // The part must begin at a whole texel of the level, so that nothing is filtered anew.
        let start = first.map(|n| u64::from(n) * u64::from(step));
        let is_whole = start.iter().all(|n| n % (1 << up) == 0);
        if !is_whole || covered.iter().any(|tiles| tiles.is_empty()) {
            plan.notices.push(Notice::PartEndsAtLevel(tree.finest - up + 1));
            break;
        }
        let origin = |axis: usize| u64::from(covered[axis].start) * u64::from(step) - (start[axis] >> up);
        let [stored_width, stored_height, _] = geometry.level(up as u8).size;
        let [columns, rows] = covered.clone();
        plan.levels.push(LevelPlan {
            directory: PathBuf::from(format!("level{}", tree.finest - up)),
            prefix: "tx_".into(),
            level: up as u8,
            stored: [stored_width, stored_height],
            size: [stored_width, stored_height],
            columns,
            rows,
            origin: [origin(0) as u32, origin(1) as u32],
            step,
            reach: Reach::Border(tree.border),
            wraps: is_whole_planet,
            may_lack_tiles: true,
        });
    }
    Ok(plan)
}

/// The files that tell each program of the tree, where it can read it.
fn texts(layout: Layout, tree: Tree, format: TileFormat, name: &str) -> Vec<(PathBuf, String)> {
    let Tree { side, border, finest } = tree;
    let mut texts = Vec::new();
    let gaia_sky = layout == Layout::GaiaSky || GAIA_SKY_TILES.contains(&side);
    if gaia_sky {
        let text = format!(
            "{{\"updates\": [{{\"name\": \"{name}\", \"model\": {{\"material\": {{\"diffuseSVT\": {{\
             \"location\": \"$data/{name}\", \"tileSize\": {side}}}}}}}}}]}}\n"
        );
        texts.push((PathBuf::from(format!("{name}.json")), text));
    }
    let celestia = CELESTIA_TILES.contains(&side) && finest <= CELESTIA_FINEST && border == 0;
    if celestia {
        let text = format!(
            "VirtualTexture\n{{\n    ImageDirectory \".\"\n    BaseSplit 0\n    TileSize {side}\n    TileType \
             \"{}\"\n    TilePrefix \"tx_\"\n}}\n",
            format.extension()
        );
        texts.push((PathBuf::from(format!("{name}.ctx")), text));
    }
    texts
}
