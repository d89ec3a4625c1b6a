// 4x4 texels where the picture enlarges the texture, blended with one tap where it does so by less than a level.
// CPU twin: twins/sample.rs.

fn vastex_filtered(position: VastexPosition, footprint: VastexFootprint, level: f32) -> vec4<f32> {
    let taps = VastexTaps(vec2<f32>(0.0), 1u, vastex_cubic_share(footprint.lambda));
    let finer = floor(level);
    let share = level - finer;
    // A loop, so that what is in it stands once in the program. With a share there is a coarser level.
    let levels = select(2u, 1u, share == 0.0);
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < levels; nth++) {
        let weight = select(1.0 - share, share, nth == 1u);
        sum += weight * vastex_shown(position, taps, u32(finer) + nth);
    }
    return sum;
}

// What the filter takes of the tile at a place, and around it.
fn vastex_taken(position: VastexPosition, place: VastexPlace, taps: VastexTaps, wanted: u32) -> vec4<f32> {
    var linear = vec4<f32>(0.0);
    if taps.cubic_share < 1.0 {
        linear = vastex_atlas_linear(place);
    }
    if taps.cubic_share == 0.0 {
        return linear;
    }
    return mix(linear, vastex_cubic(position, place, wanted), taps.cubic_share);
}

// How much of the cubic: all where a texel of the finest level that is sampled covers two pixels, none where it covers one.
fn vastex_cubic_share(lambda: f32) -> f32 {
    return clamp(vastex_unbiased_level(lambda) - (lambda + vastex_texture.bias), 0.0, 1.0);
}

// 4x4 texels around a place. Those that a narrow border does not have are looked up in their own pages, and so are those around a
// place beyond an edge, where the cubic goes on for a texel and a half.
fn vastex_cubic(position: VastexPosition, place: VastexPlace, wanted: u32) -> vec4<f32> {
    let middle = vastex_free_tile_texel(position, place.page, place.level);
    let centred = middle - 0.5;
    let first = floor(centred) - 1.0;
    let x = vastex_cubic_weights(fract(centred.x));
    let y = vastex_cubic_weights(fract(centred.y));
    let bounds = vastex_tile_bounds(position, place);
    let is_within = all(first >= bounds.xy - 0.5) && all(first + 3.5 < bounds.zw);
    let near = select(0u, 16u, is_within);
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < near; nth++) {
        let texel = first + vec2<f32>(f32(nth & 3u), f32(nth >> 2u));
        sum += x[nth & 3u] * y[nth >> 2u] * vastex_atlas_texel(place.origin + vec2<u32>(texel), place.image);
    }
    let scale = vec2<f32>(vastex_texture.levels[place.level].scale.xy) * f32(vastex_pool.layer_scale);
    for (var nth = near; nth < 16u; nth++) {
        let texel = first + vec2<f32>(f32(nth & 3u), f32(nth >> 2u));
        let offset = (texel + 0.5 - middle) * scale;
        sum += x[nth & 3u] * y[nth >> 2u] * vastex_shown_beside(position, offset, wanted);
    }
    return sum;
}
