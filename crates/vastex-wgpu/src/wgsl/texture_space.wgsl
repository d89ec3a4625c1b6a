// Texture space: the surface drawn where its uv lies, and of each part of the texture the level that the picture needs there.
//
// A texel of the target is 0 where nothing is seen, else VASTEX_TEXTURE_SPACE_FINEST less the level in eighths, so that where
// surfaces overlap the largest is the sharpest. vastex_core::LevelImage reads it.

// Where a vertex lies in the target; uv is 0 to 1 over the texture.
fn vastex_texture_space_clip(uv: vec2<f32>) -> vec4<f32> {
    return vec4<f32>((2.0 * uv.x) - 1.0, 1.0 - (2.0 * uv.y), 0.0, 1.0);
}

// How uv and the picture's clip position change from texel to texel of the target, to the right and downward.
struct VastexiAlong {
    uv_dx: vec2<f32>,
    uv_dy: vec2<f32>,
    clip_dx: vec4<f32>,
    clip_dy: vec4<f32>,
}

fn vastexi_texture_space(
    texture: VastexiTexture,
    along: VastexiAlong,
    clip: vec4<f32>,
    picture: vec2<f32>,
    front: bool,
    most_taps: u32,
) -> vec4<f32> {
    if !texture.is_known {
        return vec4<f32>(0.0);
    }
    // Along a texel of the target one coordinate of uv changes, and clip space is linear in it.
    let across = vec2<f32>(along.uv_dx.x, along.uv_dy.y) * vec2<f32>(texture.size);
    var least = VASTEXI_COARSEST;
    var beside = vec4<u32>(0u);
    var behind = 0u;
    var turned = 0u;
    for (var n = 0; n < 9; n++) {
        let at = vec2<f32>(f32(n % 3) - 1.0, f32(n / 3) - 1.0) * 0.5;
        let here = clip + at.x * along.clip_dx + at.y * along.clip_dy;
        if here.w <= 0.0 {
            behind += 1u;
            continue;
        }
        beside += vec4<u32>(vec4<bool>(here.xy > here.ww, here.xy < -here.ww));
        // Pixels along a texel of the target; down the picture y grows.
        let half_picture = vec2<f32>(0.5, -0.5) * picture / (here.w * here.w);
        let dx = (along.clip_dx.xy * here.w - here.xy * along.clip_dx.w) * half_picture;
        let dy = (along.clip_dy.xy * here.w - here.xy * along.clip_dy.w) * half_picture;
        let area = dx.x * dy.y - dx.y * dy.x;
        turned += select(0u, 1u, front && area * across.x * across.y <= 0.0);
        // Texels of the texture along a pixel: the inverse.
        let along_x = vec2<f32>(dy.y * across.x, -dx.y * across.y) / area;
        let along_y = vec2<f32>(-dy.x * across.x, dx.x * across.y) / area;
        least = min(least, vastexi_footprint(along_x, along_y, most_taps).lambda);
    }
    let in_front = 9u - behind;
    if any(beside == vec4<u32>(in_front)) || turned == in_front {
        return vec4<f32>(0.0);
    }
    let steps = u32(floor(vastexi_unbiased_level(texture, least) * f32(VASTEX_STEPS_PER_LEVEL)));
    let sharpness = max(VASTEX_TEXTURE_SPACE_FINEST, steps + 1u) - steps;
    return vec4<f32>(f32(sharpness) / f32(VASTEX_TEXTURE_SPACE_FINEST), 0.0, 0.0, 1.0);
}
