// One texel of one level: the nearest filter, and whatever filter where values may not be mixed.
// CPU twin: twins/sample.rs.

fn vastexi_filtered_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    footprint: VastexiFootprint,
    level: f32,
) -> vec4<f32> {
    return vastexi_shown_KIND(texture, position, VastexiTaps(vec2<f32>(0.0), 1u, 0.0), vastexi_whole(floor(level)));
}

// What the filter takes of the tile at a place.
fn vastexi_taken_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    place: VastexiPlace,
    taps: VastexiTaps,
    wanted: u32,
) -> vec4<f32> {
    return vastexi_texel_LAYER(place, vec2<u32>(floor(place.tile_texel)));
}
