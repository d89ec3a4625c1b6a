// An atlas that the device does not filter: four taps by hand, so that values stay exact.

// What is at a place: one texel, or the four around it by their distance.
fn vastexi_tap_LAYER(place: VastexiPlace, is_nearest: bool) -> vec4<f32> {
    if is_nearest {
        return vastexi_texel_LAYER(place.origin + vec2<u32>(floor(place.tile_texel)), place.image);
    }
    let centred = place.tile_texel - 0.5;
    let first = floor(centred);
    let weight = centred - first;
    let at = place.origin + vec2<u32>(first);
    let upper = mix(
        vastexi_texel_LAYER(at, place.image),
        vastexi_texel_LAYER(at + vec2<u32>(1u, 0u), place.image),
        weight.x,
    );
    let lower = mix(
        vastexi_texel_LAYER(at + vec2<u32>(0u, 1u), place.image),
        vastexi_texel_LAYER(at + vec2<u32>(1u, 1u), place.image),
        weight.x,
    );
    return mix(upper, lower, weight.y);
}
