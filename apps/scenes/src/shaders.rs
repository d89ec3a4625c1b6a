//! The shader texts of scenes: which modules are joined, each beside Vastex's own text, which is the same for all pipelines.
//!
//! One text has every entry point of what is drawn with one bind group, so there are as few texts as there are kinds of what is
//! sampled. What a pipeline is told beside that are constants that it is made with.

use crate::look::Look;
use crate::patches::QUADS;
use crate::planet::Attribute;

/// A surface without heights: its picture, its feedback, texture space, overlays, and the ordinary texture that it is compared with.
const FLAT: [&str; 13] = [
    include_str!("wgsl/picture.wgsl"),
    include_str!("wgsl/wanted.wgsl"),
    include_str!("wgsl/texture_space.wgsl"),
    include_str!("wgsl/coordinates.wgsl"),
    include_str!("wgsl/reference.wgsl"),
    include_str!("wgsl/overlay_surface.wgsl"),
    include_str!("wgsl/overlay_plain.wgsl"),
    include_str!("wgsl/overlay_plan.wgsl"),
    include_str!("wgsl/overlay_feedback.wgsl"),
    include_str!("wgsl/overlay_table.wgsl"),
    include_str!("wgsl/overlay_atlas.wgsl"),
    include_str!("wgsl/overlay_palette.wgsl"),
    include_str!("wgsl/unlit.wgsl"),
];

/// A surface displaced by heights.
const RELIEF: [&str; 6] = [
    include_str!("wgsl/relief.wgsl"),
    include_str!("wgsl/relief_wanted.wgsl"),
    include_str!("wgsl/coordinates.wgsl"),
    include_str!("wgsl/overlay_surface.wgsl"),
    include_str!("wgsl/overlay_relief.wgsl"),
    include_str!("wgsl/overlay_palette.wgsl"),
];

const SURFACE: &str = include_str!("wgsl/surface.wgsl");
const PLANET: &str = include_str!("wgsl/planet.wgsl");
const PLANET_WANTED: &str = include_str!("wgsl/planet_wanted.wgsl");
const PLANET_REFERENCE: &str = include_str!("wgsl/planet_reference.wgsl");

/// Of a scene without heights; `vastex` is the text for its layer.
pub fn flat(vastex: &str) -> String {
    joined(&FLAT, &[SURFACE, &Look::wgsl(), vastex])
}

/// Of a scene with heights; `vastex` is the text for a group of `color` and `height`.
pub fn relief(vastex: &str) -> String {
    let quads = format!("const RELIEF_QUADS: u32 = {QUADS}u;\n");
    joined(&RELIEF, &[SURFACE, &Look::wgsl(), &quads, vastex])
}

/// Of a planet with textures of these attributes; `vastex` is the text for their group.
pub fn planet(vastex: &str, parts: &[Attribute]) -> String {
    let sampled = |attribute: Attribute| match parts.contains(&attribute) {
        true => function(attribute, &format!("vastex_sample_{}_grad(uv, ddx, ddy)", attribute.name())),
        false => function(attribute, attribute.without()),
    };
    let sampled: String = Attribute::ALL.into_iter().map(sampled).collect();
    joined(&[PLANET, PLANET_WANTED], &[&sampled, vastex])
}

/// Bindings that an ordinary texture of a planet takes.
pub(crate) const ORDINARY_BINDINGS: u32 = 3;

/// Of the same planet sampled from ordinary textures, the group's textures in the order of `parts`, its shape before them.
pub fn ordinary_planet(vastex: &str, parts: &[Attribute]) -> String {
    let sampled = |attribute: Attribute| {
        let place = (0..).zip(parts).find(|(_, part)| **part == attribute);
        let Some((place, _)) = place else { return function(attribute, attribute.without()) };
        let text = PLANET_REFERENCE.replace("MEMBER", attribute.name());
        let text = text.replace("TEXTURE_PLACE", &(place + 1).to_string());
        let bindings = ["TEXTURE_BINDING", "SAMPLER_BINDING", "PARAMS_BINDING"];
        (place * ORDINARY_BINDINGS..)
            .zip(bindings)
            .fold(text, |text, (n, name)| text.replace(name, &n.to_string()))
    };
    let sampled: String = Attribute::ALL.into_iter().map(sampled).collect();
    joined(&[PLANET], &[&sampled, vastex])
}

/// Of a globe in fixed point.
pub fn descent(vastex: &str) -> String {
    joined(&[include_str!("wgsl/descent.wgsl")], &[vastex])
}

/// The function by which planet.wgsl samples an attribute.
fn function(attribute: Attribute, value: &str) -> String {
    format!(
        "fn planet_{}(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {{\n    return {value};\n}}\n",
        attribute.name()
    )
}

fn joined(modules: &[&str], rest: &[&str]) -> String {
    [modules, rest].concat().join("\n")
}
