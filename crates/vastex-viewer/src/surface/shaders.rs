//! The shader texts of surfaces: which modules are joined, each beside Vastex's own text, which is the same
//! for all pipelines.
//!
//! One text has every entry point of what is drawn with one bind group, so there are as few texts as there
//! are kinds of what is sampled. What a pipeline is told beside that are constants that it is made with.
//!
//! There are two surfaces, flat ones and those that heights displace, and each is placed in two ways: as a
//! mesh in uv and in fixed point. What is drawn is the same for all of them, in modules in which `WAY` is
//! replaced.

use super::patches::QUADS;
use super::poles::AROUND;
use crate::layers::{ColorMap, LayersText};

/// The ways in which a surface is placed.
const WAYS: [&str; 2] = ["mesh", "fixed"];

/// What every text has.
const SHARED: [&str; 4] = [
    include_str!("wgsl/look.wgsl"),
    include_str!("wgsl/surface.wgsl"),
    include_str!("../stage/wgsl/display.wgsl"),
    include_str!("../overlay/wgsl/palette.wgsl"),
];

/// What is drawn in either way: the picture, what the CPU makes pictures of, and overlays.
const OF_WAYS: [&str; 3] = [
    include_str!("wgsl/picture.wgsl"),
    include_str!("wgsl/coordinates.wgsl"),
    include_str!("../overlay/wgsl/surface.wgsl"),
];
const OVERLAY_TEXELS: &str = include_str!("../overlay/wgsl/texels.wgsl");

/// A surface without heights: its two ways, and texture space.
const FLAT: [&str; 3] = [
    include_str!("wgsl/mesh.wgsl"),
    include_str!("wgsl/fixed.wgsl"),
    include_str!("wgsl/texture_space.wgsl"),
];

/// A surface displaced by heights, in its two ways.
const RELIEF: [&str; 2] = [include_str!("wgsl/relief.wgsl"), include_str!("wgsl/relief_fixed.wgsl")];

/// What there is of a planet beside its relief.
const PLANET: [&str; 2] = [include_str!("wgsl/planet.wgsl"), include_str!("wgsl/planet_ways.wgsl")];

/// What there is of one layer alone: the ordinary texture that it is compared with, and plans.
const ALONE: [&str; 5] = [
    include_str!("wgsl/reference.wgsl"),
    include_str!("../overlay/wgsl/plan.wgsl"),
    include_str!("../overlay/wgsl/feedback.wgsl"),
    include_str!("../overlay/wgsl/table.wgsl"),
    include_str!("../overlay/wgsl/atlas.wgsl"),
];
const ALONE_OF_WAYS: [&str; 1] = [include_str!("wgsl/reference_picture.wgsl")];

const LAYERED: &str = include_str!("wgsl/layered.wgsl");

/// Of a scene without heights that has one opaque layer on it; `vastex` is the text for that.
pub fn flat(vastex: &str) -> String {
    layered(vastex, LayersText::ALONE)
}

/// Of a scene without heights; `vastex` is the text for what the layers are sampled by.
pub fn layered(vastex: &str, layers: LayersText) -> String {
    let mut modules = parts(layers);
    modules.extend(FLAT.map(str::to_owned));
    if layers == LayersText::ALONE {
        modules.extend(ALONE.map(str::to_owned));
        modules.extend(of_ways(&ALONE_OF_WAYS));
    }
    joined(modules, vastex)
}

/// Of a scene with heights or of a planet, where any layer may stand for heights; `vastex` is the text for a
/// group of `layer0` and so on and `height`.
pub fn relief(vastex: &str, layers: LayersText) -> String {
    let mut modules = parts(layers);
    modules.extend(RELIEF.map(str::to_owned));
    if layers.planet.is_some() {
        modules.extend(PLANET.map(str::to_owned));
    }
    modules.push(format!("const RELIEF_QUADS: u32 = {QUADS}u;\nconst RELIEF_AROUND: u32 = {AROUND}u;\n"));
    joined(modules, vastex)
}

/// What all surfaces have that show these layers.
fn parts(layers: LayersText) -> Vec<String> {
    let mut modules: Vec<String> = SHARED.map(str::to_owned).to_vec();
    modules.extend(of_ways(&OF_WAYS));
    modules.push(OVERLAY_TEXELS.to_owned());
    modules.extend([ColorMap::wgsl(), layers.wgsl()]);
    modules.extend((!layers.is_single).then(|| LAYERED.to_owned()));
    modules
}

fn of_ways(modules: &[&str]) -> Vec<String> {
    WAYS.iter().flat_map(|way| modules.iter().map(|module| module.replace("WAY", way))).collect()
}

fn joined(mut modules: Vec<String>, vastex: &str) -> String {
    modules.push(vastex.to_owned());
    modules.join("\n")
}
