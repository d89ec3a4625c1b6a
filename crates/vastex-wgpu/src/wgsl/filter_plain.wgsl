// One tap at a level: nearest, bilinear and trilinear filters.
// CPU twin: twins/sample.rs.

fn vastex_filtered(position: VastexPosition, footprint: VastexFootprint, level: f32) -> vec4<f32> {
    let finer = u32(floor(level));
    let taps = VastexTaps(vec2<f32>(0.0), 1u, 0.0);
    let sharp = vastex_shown(position, taps, finer);
    let share = level - f32(finer);
    if VASTEX_FILTER != VASTEX_FILTER_TRILINEAR || share == 0.0 {
        return sharp;
    }
    // There is a coarser level, since the coarsest is a whole number.
    return mix(sharp, vastex_shown(position, taps, finer + 1u), share);
}

// What the filter takes of the tile at a place.
fn vastex_taken(position: VastexPosition, place: VastexPlace, taps: VastexTaps, wanted: u32) -> vec4<f32> {
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        return vastex_atlas_nearest(place);
    }
    return vastex_atlas_linear(place);
}
