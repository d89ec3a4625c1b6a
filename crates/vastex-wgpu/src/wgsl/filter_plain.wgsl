// One tap at a level: bilinear and trilinear filters.
// CPU twin: twins/sample.rs.

fn vastexi_filtered_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    footprint: VastexiFootprint,
    level: f32,
) -> vec4<f32> {
    let whole = floor(level);
    let finer = vastexi_whole(whole);
    let taps = VastexiTaps(vec2<f32>(0.0), 1u, 0.0);
    let sharp = vastexi_shown_KIND(texture, position, taps, finer);
    let share = level - whole;
    if VASTEXI_FILTER_KIND != VASTEXI_FILTER_TRILINEAR || share == 0.0 {
        return sharp;
    }
    // There is a coarser level, since the coarsest is a whole number.
    return mix(sharp, vastexi_shown_KIND(texture, position, taps, finer + 1u), share);
}

// What the filter takes of the tile at a place.
fn vastexi_taken_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    place: VastexiPlace,
    taps: VastexiTaps,
    wanted: u32,
) -> vec4<f32> {
    return vastexi_tap_LAYER(place);
}
