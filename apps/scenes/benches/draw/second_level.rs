//! Tried: slots that hold a second level, so that the hardware does trilinear in one lookup. docs/second-level.md says what came of it.

use anyhow::Result;
use vastex_wgpu::{TableChoice, TableKinds};

use crate::lookups::Lookups;
use crate::world::Bench;

/// In the place of the filter: one lookup, and the second level of the same slot.
const ONE_LOOKUP: &str = "
@group(1) @binding(1) var second_atlas: texture_2d_array<f32>;
@group(1) @binding(2) var second_sampler: sampler;
fn vastex_filtered(position: VastexPosition, footprint: VastexFootprint, level: f32) -> vec4<f32> {
    let place = vastex_place(position, u32(floor(level)));
    let atlas_uv = (vec2<f32>(place.origin) + place.tile_texel) * vastex_pool.texel;
    let second = clamp(level - f32(place.level), 0.0, 1.0);
    return textureSampleLevel(second_atlas, second_sampler, atlas_uv, place.image, second);
}
";

pub(crate) fn section(bench: &Bench) -> Result<String> {
    let lookups = Lookups::new(bench)?;
    let table = lookups.table(TableChoice::Direct, &lookups.resident(0))?;
    let [two, one] = lookups.measure(&[
        lookups.case(&table, TableKinds::Direct, None),
        lookups.case(&table, TableKinds::Direct, Some(("vastex_filtered", ONE_LOOKUP))),
    ]);
    Ok(format!(
        "## A second level in each slot\n\nThe samples of the section before, everything resident, beside one lookup in an atlas whose slots hold the next level too\n\
         ([what came of it](second-level.md)).\n\n\
         | | ms | of two lookups | pool memory and uploads |\n|---|---|---|---|\n\
         | two lookups | {two:.2} | 1.00 | 1.00 |\n| one, by the hardware's trilinear | {one:.2} | {:.2} | 1.25 |\n",
        one / two
    ))
}
