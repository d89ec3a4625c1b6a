// An atlas that the device does not filter: four taps by hand, so that values stay exact.

// What is at a place: the four texels around it by their distance.
fn vastexi_tap_LAYER(place: VastexiPlace) -> vec4<f32> {
    let centred = place.tile_texel - 0.5;
    let first = floor(centred);
    let weight = centred - first;
    let at = vec2<u32>(first);
    let upper = mix(vastexi_texel_LAYER(place, at), vastexi_texel_LAYER(place, at + vec2<u32>(1u, 0u)), weight.x);
    let lower = mix(
        vastexi_texel_LAYER(place, at + vec2<u32>(0u, 1u)),
        vastexi_texel_LAYER(place, at + vec2<u32>(1u, 1u)),
        weight.x,
    );
    return mix(upper, lower, weight.y);
}
