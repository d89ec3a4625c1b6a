// 4x4 texels where the picture enlarges the texture, blended with one tap where it does so by less than a level.
// CPU twin: twins/sample.rs.

fn vastexi_filtered_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    footprint: VastexiFootprint,
    level: f32,
) -> vec4<f32> {
    // How much of the cubic: all where a texel of the finest level that is sampled covers two pixels, none where it covers one.
    let lambda = footprint.lambda;
    let enlarged = clamp(vastexi_unbiased_level(texture, lambda) - (lambda + texture.bias), 0.0, 1.0);
    let taps = VastexiTaps(vec2<f32>(0.0), 1u, enlarged);
    return vastexi_levels_KIND(texture, position, taps, level);
}

// What the filter takes of the tile at a place, and around it.
fn vastexi_taken_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    place: VastexiPlace,
    taps: VastexiTaps,
    wanted: u32,
) -> vec4<f32> {
    var linear = vec4<f32>(0.0);
    if taps.cubic_share < 1.0 {
        linear = vastexi_tap_LAYER(place);
    }
    if taps.cubic_share == 0.0 {
        return linear;
    }
    return mix(linear, vastexi_cubic_KIND(texture, position, place, wanted), taps.cubic_share);
}

// 4x4 texels around a place. Those that a narrow border does not have are looked up in their own pages, and so are those around a
// place beyond an edge, where the cubic goes on for a texel and a half.
fn vastexi_cubic_KIND(texture: VastexiTexture, position: VastexiPosition, place: VastexiPlace, wanted: u32) -> vec4<f32> {
    let level = vastexi_level(texture, place.level, VASTEXI_POWERS_POOL);
    let scale = f32(VASTEXI_SCALE_LAYER);
    let middle = vastexi_free_tile_texel(level, position, place.page, VASTEXI_POWERS_POOL) / scale;
    let centred = middle - 0.5;
    let first = floor(centred) - 1.0;
    let x = vastexi_cubic_weights(fract(centred.x));
    let y = vastexi_cubic_weights(fract(centred.y));
    let bounds = vastexi_tile_bounds(texture, position, place, VASTEXI_POWERS_POOL, VASTEXI_SCALE_LAYER);
    let is_within = all(first >= bounds.xy - 0.5) & all(first + 3.5 < bounds.zw);
    let near = select(0u, 16u, is_within);
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < near; nth++) {
        let texel = first + vec2<f32>(f32(nth & 3u), f32(nth >> 2u));
        let value = vastexi_texel_LAYER(place, vec2<u32>(texel));
        sum += x[nth & 3u] * y[nth >> 2u] * value;
    }
    let texels = vec2<f32>(vastexi_scale(level, VASTEXI_POWERS_POOL)) * scale;
    for (var nth = near; nth < 16u; nth++) {
        let texel = first + vec2<f32>(f32(nth & 3u), f32(nth >> 2u));
        let offset = (texel + 0.5 - middle) * texels;
        sum += x[nth & 3u] * y[nth >> 2u] * vastexi_shown_beside_KIND(texture, position, offset, wanted);
    }
    return sum;
}
