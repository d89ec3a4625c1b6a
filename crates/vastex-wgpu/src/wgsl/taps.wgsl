// An atlas that the device does not filter: four taps by hand, so that values stay exact.

fn vastex_atlas_nearest(place: VastexPlace) -> vec4<f32> {
    return vastex_atlas_texel(place.origin + vec2<u32>(floor(place.tile_texel)), place.image);
}

fn vastex_atlas_linear(place: VastexPlace) -> vec4<f32> {
    let centred = place.tile_texel - 0.5;
    let first = floor(centred);
    let weight = centred - first;
    let at = place.origin + vec2<u32>(first);
    let upper = mix(
        vastex_atlas_texel(at, place.image),
        vastex_atlas_texel(at + vec2<u32>(1u, 0u), place.image),
        weight.x,
    );
    let lower = mix(
        vastex_atlas_texel(at + vec2<u32>(0u, 1u), place.image),
        vastex_atlas_texel(at + vec2<u32>(1u, 1u), place.image),
        weight.x,
    );
    return mix(upper, lower, weight.y);
}
