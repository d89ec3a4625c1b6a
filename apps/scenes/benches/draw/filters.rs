//! The price of a virtual texture, filter by filter, beside an ordinary one with the same taps.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::Result;
use glam::Vec3;
use vastex::{Filter, MaxTaps};
use vastex_scenes::{Pose, Scene};

use crate::world::{Bench, picture, resident};

/// Draws of each kind, in turns.
const ROUNDS: usize = 15;

pub(crate) fn section(bench: &Bench) -> Result<String> {
    let [width, height] = picture(&bench.gpu);
    let mut page = format!(
        "## Filters\n\nA frame of {width}x{height} of a texture of which every page is resident, beside an ordinary mip-mapped texture\n\
         with the same taps in the same draw (two explicit levels), and by the adapter's own trilinear or anisotropic filter,\n\
         with how alike that picture is. {ROUNDS} draws of each, in turns; the ratio is the median of those within a turn.\n\n\
         | view | filter | virtual ms | ordinary ms | virtual / ordinary | adapter's own ms | likeness dB |\n|---|---|---|---|---|---|---|\n"
    );
    let ground = Pose::Plane { eye: Vec3::new(0.1, -0.9, 0.12), yaw: 0.2, pitch: 0.25 };
    let close = Pose::Plane { eye: Vec3::new(0.1, -0.3, 0.004), yaw: 0.2, pitch: 1.2 };
    let anisotropic = [2, 4, 8, 16].into_iter().filter_map(MaxTaps::new).map(Filter::Anisotropic);
    let filters = [Filter::Nearest, Filter::Bilinear, Filter::Trilinear].into_iter().chain(anisotropic);
    let views = filters
        .map(|filter| ("along the ground", ground, filter))
        .chain([Filter::Trilinear, Filter::Bicubic].map(|filter| ("close to it", close, filter)));
    for (view, pose, filter) in views {
        let studio = resident(bench, filter, Scene::Plane, pose)?;
        let costs = studio.costs(&bench.clock, ROUNDS)?;
        let ms = |taken: Duration| taken.as_secs_f64() * 1e3;
        writeln!(
            page,
            "| {view} | {filter} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} |",
            ms(costs.of_virtual),
            ms(costs.of_ordinary),
            costs.to_ordinary,
            ms(costs.of_adapter),
            costs.to_adapter.psnr_db,
        )?;
    }
    Ok(page)
}
