//! The shader texts of surfaces: which modules are joined, each beside Vastex's own text, which is the same for all pipelines.
//!
//! One text has every entry point of what is drawn with one bind group, so there are as few texts as there are kinds of what is
//! sampled. What a pipeline is told beside that are constants that it is made with.

use super::patches::QUADS;
use crate::layers::{ColorMap, Layers};

/// A surface without heights: its picture, its feedback, texture space, overlays, and the ordinary texture that it is compared with.
const FLAT: [&str; 15] = [
    include_str!("wgsl/picture.wgsl"),
    include_str!("wgsl/wanted.wgsl"),
    include_str!("wgsl/fixed.wgsl"),
    include_str!("wgsl/texture_space.wgsl"),
    include_str!("wgsl/coordinates.wgsl"),
    include_str!("wgsl/reference.wgsl"),
    include_str!("../overlay/wgsl/surface.wgsl"),
    include_str!("../overlay/wgsl/plain.wgsl"),
    include_str!("../overlay/wgsl/plan.wgsl"),
    include_str!("../overlay/wgsl/feedback.wgsl"),
    include_str!("../overlay/wgsl/table.wgsl"),
    include_str!("../overlay/wgsl/atlas.wgsl"),
    include_str!("../overlay/wgsl/palette.wgsl"),
    include_str!("wgsl/unlit.wgsl"),
    include_str!("../stage/wgsl/display.wgsl"),
];

/// A surface without heights and with several layers on it.
const LAYERED: [&str; 2] = [include_str!("wgsl/layered.wgsl"), include_str!("../stage/wgsl/display.wgsl")];

/// A surface displaced by heights.
const RELIEF: [&str; 7] = [
    include_str!("wgsl/relief.wgsl"),
    include_str!("wgsl/relief_wanted.wgsl"),
    include_str!("wgsl/coordinates.wgsl"),
    include_str!("../overlay/wgsl/surface.wgsl"),
    include_str!("../overlay/wgsl/relief.wgsl"),
    include_str!("../stage/wgsl/display.wgsl"),
    include_str!("../overlay/wgsl/palette.wgsl"),
];

const SURFACE: &str = include_str!("wgsl/surface.wgsl");
/// Of a scene without heights; `vastex` is the text for its layer.
pub fn flat(vastex: &str) -> String {
    joined(&FLAT, &[SURFACE, &ColorMap::wgsl(), vastex])
}

/// Of a scene with so many layers; `vastex` is the text for the group of a list of them.
pub fn layered(vastex: &str, count: usize) -> String {
    joined(&LAYERED, &[SURFACE, &ColorMap::wgsl(), &Layers::wgsl(count), vastex])
}

/// Of a scene with heights; `vastex` is the text for a group of `color` and `height`.
pub fn relief(vastex: &str) -> String {
    let quads = format!("const RELIEF_QUADS: u32 = {QUADS}u;\n");
    joined(&RELIEF, &[SURFACE, &ColorMap::wgsl(), &quads, vastex])
}

fn joined(modules: &[&str], rest: &[&str]) -> String {
    [modules, rest].concat().join("\n")
}
