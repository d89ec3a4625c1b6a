//! The price of a target of light: one opaque layer straight into the picture and by way of half floats, and
//! several layers.

use std::fmt::Write as _;

use anyhow::Result;
use vastex::{Filter, Pace, PoolSettings, Region, Settings};
use vastex_scenes::{DisplayOptions, LayerOptions, Offscreen, Pose, Scene};
use vastex_viewer::stage::TargetKind;

use crate::world::{Bench, Part, fetch, picture, property};

/// Draws of each kind, in turns.
const ROUNDS: usize = 15;

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let [width, height] = picture(&bench.gpu);
    let mut page = format!(
        "## Targets of light\n\nA frame of {width}x{height} of one opaque layer, drawn straight into 8 bits, and times that: the same drawn again, by \
         way of half floats that are encoded at its end, and as a list of two and of four layers, each half as opaque as the first. Every \
         page is resident. {ROUNDS} draws of each, in turns; the ratio is the median of those within a turn.\n\n\
         | scene | straight ms | again | by light | two layers | four layers |\n|---|---|---|---|---|---|\n"
    );
    for scene in [Scene::Image, Scene::Globe] {
        let of = |layers, target| view(bench, scene, layers, target);
        let others = [
            of(1, TargetKind::Direct)?,
            of(1, TargetKind::Linear)?,
            of(2, TargetKind::Linear)?,
            of(4, TargetKind::Linear)?,
        ];
        let costs = of(1, TargetKind::Direct)?.costs_beside(&others, &bench.clock, ROUNDS);
        write!(page, "| {} | {:.2} |", scene.name(), costs.of_this.as_secs_f64() * 1e3)?;
        for ratio in costs.others_to_this {
            write!(page, " {ratio:.2} |")?;
        }
        page.push('\n');
    }
    Ok((page, Vec::new()))
}

/// A view of so many layers, all of the one that there is.
fn view(bench: &Bench, scene: Scene, layers: usize, target: TargetKind) -> Result<Offscreen> {
    let layer =
        |n: usize| LayerOptions { opacity: if n == 0 { 1.0 } else { 0.5 }, ..LayerOptions::default() };
    let layers = (0..layers).map(layer).collect();
    let shown = DisplayOptions { layers, target: Some(target), ..DisplayOptions::default() };
    let settings = Settings {
        pools: PoolSettings::of_bytes(160 << 20),
        upload_bytes_per_frame: 8 << 20,
        pace: Pace::LockStep { latency_frames: 1 },
        filter: Filter::Trilinear,
        ..Settings::default()
    };
    let size = picture(&bench.gpu);
    let mut offscreen = Offscreen::showing(&shown, &bench.gpu, property()?, scene, size, settings)?;
    fetch(&mut offscreen, Pose::first(scene), &Region::whole())?;
    Ok(offscreen)
}
