//! The price of tiles that fade in: where they might and all are there, and while they do.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::{Context, Result};
use glam::DVec3;
use vastex::{Filter, LevelRule, MaxTaps, Region};
use vastex_scenes::{Offscreen, Pose, Scene};

use crate::world::{Bench, Part, fetch, new_studio, picture, property, resident, texture};

/// Draws of each kind, in turns.
const ROUNDS: usize = 15;
const FADE: Duration = Duration::from_millis(200);

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let [width, height] = picture(&bench.gpu);
    let mut page = format!(
        "## Tiles that fade in\n\nA frame of {width}x{height} of a texture of which every page is resident, without fading, and times that with\n\
         `Settings::fade`: where all tiles are there, while those of level 0 are halfway over others that are there, and while all of\n\
         all levels are. {ROUNDS} draws of each, in turns; the ratio is the median of those within a turn.\n\n\
         | view | filter | without ms | all there | level 0 halfway | all halfway |\n|---|---|---|---|---|---|\n"
    );
    let ground = Pose::Plane { eye: DVec3::new(0.1, -0.9, 0.12), yaw: 0.2, pitch: 0.25 };
    let close = Pose::Plane { eye: DVec3::new(0.1, -0.3, 0.004), yaw: 0.2, pitch: 1.2 };
    let anisotropic = MaxTaps::new(8).map(Filter::Anisotropic).context("a filter of 8 taps")?;
    let views = [
        ("along the ground", ground, Filter::Nearest),
        ("along the ground", ground, Filter::Trilinear),
        ("along the ground", ground, anisotropic),
        ("close to it", close, Filter::Trilinear),
        ("close to it", close, Filter::Bicubic),
    ];
    for (view, pose, filter) in views {
        let without = resident(bench, property()?, filter, Scene::Plane, pose)?;
        let mut fading = Vec::new();
        for (at_once, halfway) in
            [(0..=u8::MAX, None), (1..=u8::MAX, Some(0..=0)), (u8::MAX..=u8::MAX, Some(0..=u8::MAX))]
        {
            let mut offscreen = new_studio(bench, property()?, filter, Scene::Plane, FADE)?;
            come(&mut offscreen, pose, at_once, FADE)?;
            if let Some(levels) = halfway {
                come(&mut offscreen, pose, levels, FADE / 2)?;
            }
            fading.push(offscreen);
        }
        let costs = without.costs_beside(&fading, &bench.clock, ROUNDS);
        write!(page, "| {view} | {filter} | {:.2} |", costs.of_this.as_secs_f64() * 1e3)?;
        for ratio in costs.others_to_this {
            write!(page, " {ratio:.2} |")?;
        }
        page.push('\n');
    }
    Ok((page, Vec::new()))
}

/// All tiles of some levels, all of them come at once so much time ago.
fn come(
    offscreen: &mut Offscreen,
    pose: Pose,
    levels: std::ops::RangeInclusive<u8>,
    ago: Duration,
) -> Result<()> {
    let texture = texture(offscreen)?;
    let textures = offscreen.textures_mut();
    textures.texture_mut(texture)?.set_levels(LevelRule { finest: *levels.start(), ..LevelRule::default() });
    textures.set_frame_time(Duration::ZERO);
    fetch(offscreen, pose, &Region::whole().on_levels(levels))?;
    offscreen.textures_mut().set_frame_time(ago);
    offscreen.frame(pose)?;
    offscreen.textures_mut().texture_mut(texture)?.set_levels(LevelRule::default());
    offscreen.textures_mut().set_frame_time(Duration::ZERO);
    Ok(())
}
