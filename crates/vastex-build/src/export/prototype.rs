//! The prototype's pages: levels numbered from the finest, down to the first that is a single page.

use std::path::PathBuf;

use vastex_core::{AddressMode, Geometry};

use super::plan::{LevelPlan, Plan, Reach, coarsest};
use super::{ExportError, ExportOptions, refuse};
use crate::image::grids::prototype::{BORDER, PAGE, SIZE_FILE};

pub(super) fn plan(geometry: &Geometry, options: &ExportOptions) -> Result<Plan, ExportError> {
    if options.tile_size.is_some_and(|n| n != PAGE) || options.overlap.is_some_and(|n| n != BORDER) {
        return refuse(&format!(
            "the prototype's pages have {PAGE} texels and borders of {BORDER}; leave out both"
        ));
    }
    let [width, height, _] = geometry.size();
    let mut levels = Vec::new();
    for level in 0..=coarsest(geometry) {
        let plan = level_plan(geometry, level);
        let is_single = plan.columns.len() == 1 && plan.rows.len() == 1;
        levels.push(plan);
        if is_single {
            break;
        }
    }
    let texts = vec![(PathBuf::from(SIZE_FILE), format!("{width}x{height}\n"))];
    Ok(Plan { size: [width, height], levels, texts, notices: Vec::new() })
}

fn level_plan(geometry: &Geometry, level: u8) -> LevelPlan {
    LevelPlan {
        directory: "pages".into(),
        prefix: format!("{level}_"),
        wraps: geometry.address()[0] == AddressMode::Wrap,
        ..LevelPlan::of_level(geometry, level, PAGE, Reach::Border(BORDER))
    }
}
