//! The shader texts of scenes: which modules are joined, each beside Vastex's own text, which is the same for
//! all pipelines.
//!
//! One text has every entry point of what is drawn with one bind group, so there are as few texts as there
//! are kinds of what is sampled. What a pipeline is told beside that are constants that it is made with.

pub use vastex_viewer::shaders::{flat, layered, relief};

use crate::attribute::Attribute;

const PLANET: &str = include_str!("wgsl/planet.wgsl");
const PLANET_WANTED: &str = include_str!("wgsl/planet_wanted.wgsl");
const PLANET_REFERENCE: &str = include_str!("wgsl/planet_reference.wgsl");

/// Of a planet with textures of these attributes; `vastex` is the text for their group.
pub fn planet(vastex: &str, parts: &[Attribute]) -> String {
    let sampled = |attribute: Attribute| match parts.iter().position(|part| *part == attribute) {
        Some(place) => {
            let (name, id) = (attribute.name(), member_id(place));
            function(attribute, &format!("vastex_sample_{name}_grad({id}, uv, ddx, ddy)"))
        }
        None => function(attribute, attribute.without()),
    };
    let sampled: String = Attribute::ALL.into_iter().map(sampled).collect();
    joined(&[PLANET, PLANET_WANTED], &[&sampled, vastex])
}

/// Bindings that an ordinary texture of a planet takes.
pub(crate) const ORDINARY_BINDINGS: u32 = 3;

/// The id of a member of a planet's group, after that of the whole.
fn member_id(place: usize) -> String {
    let place = place + 1;
    format!("planet.ids[{}].{}", place / 4, ["x", "y", "z", "w"][place % 4])
}

/// Of the same planet sampled from ordinary textures in the order of `parts`; `pools` says in which pool of
/// the text each one's virtual texture lies.
pub fn ordinary_planet(vastex: &str, parts: &[Attribute], pools: &[usize]) -> String {
    let sampled = |attribute: Attribute| {
        let place = (0..).zip(parts).find(|(_, part)| **part == attribute);
        let Some((place, _)) = place else { return function(attribute, attribute.without()) };
        let text = PLANET_REFERENCE.replace("MEMBER_ID", &member_id(place as usize));
        let text = text.replace("MEMBER", attribute.name());
        let text = text.replace("POOL_PLACE", &pools[place as usize].to_string());
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
