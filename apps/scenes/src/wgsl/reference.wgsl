// The same picture from an ordinary mip-mapped texture: the same level, by the same lines, the same taps, and two explicit
// levels blended, since drivers approximate their own trilinear and anisotropic filters. The texture is padded to powers of two, so that texel
// i of a level covers exactly the texels 2i and 2i+1 of the level before it.

struct Reference {
    share: vec2<f32>,     // share of the padded texture that is picture
    layer_scale: u32,     // texels of the virtual texture along one of this one
    keeps_positions: u32, // 1 where texels of coarser levels lie at the first of those that they cover
}

@group(2) @binding(0) var reference: texture_2d<f32>;
@group(2) @binding(1) var reference_sampler: sampler;
@group(2) @binding(2) var<uniform> reference_params: Reference;

// Size of a level, padding included. Not asked of the texture: Mesa's software driver answers all pixels of a block with what
// it is at the level of one of them.
fn reference_size(level: u32) -> vec2<u32> {
    return max(textureDimensions(reference) >> vec2<u32>(level), vec2<u32>(1u));
}

// How far the texels of a level lie before the middle of those that they cover, in texels of the level.
fn reference_shift(level: u32) -> f32 {
    return f32(reference_params.keeps_positions) * (0.5 - 0.5 * exp2(-f32(level)));
}

// Which texel of a level of `size` stands at a whole place, of so many with the padding, whose end has the border colour.
fn reference_folded(at: i32, size: i32, padded: u32, mode: u32) -> u32 {
    switch mode {
        case VASTEX_ADDRESS_WRAP: {
            return u32((at % size + size) % size);
        }
        case VASTEX_ADDRESS_MIRROR: {
            let turn = (at % (2 * size) + 2 * size) % (2 * size);
            return u32(min(turn, 2 * size - 1 - turn));
        }
        case VASTEX_ADDRESS_BORDER: {
            return select(padded - 1u, u32(at), at >= 0 && at < size);
        }
        default: {
            return u32(clamp(at, 0, size - 1));
        }
    }
}

// Texels of a level without the padding.
fn reference_texels(level: u32) -> vec2<i32> {
    let layer_scale = reference_params.layer_scale;
    return vec2<i32>((vastex_texture.levels[level].size.xy + layer_scale - 1u) / layer_scale);
}

// The texel that stands at a whole place of a level, inside or beyond its edges.
fn reference_texel(at: vec2<i32>, level: u32) -> vec4<f32> {
    let size = reference_texels(level);
    let padded = reference_size(level);
    let folded = vec2<u32>(
        reference_folded(at.x, size.x, padded.x, vastex_texture.address.x),
        reference_folded(at.y, size.y, padded.y, vastex_texture.address.y),
    );
    return textureLoad(reference, folded, i32(level));
}

// Texels of level 0 along one texel of a level.
fn reference_scale(level: u32) -> vec2<u32> {
    return vastex_texture.levels[level].scale.xy * reference_params.layer_scale;
}

// Where a uv is in a level, in its texels.
fn reference_place(uv: vec2<f32>, level: u32) -> vec2<f32> {
    let position = vastex_position_from_uv(uv);
    let at = vec2<f32>(position.texel) + position.fraction;
    return at / vec2<f32>(reference_scale(level)) + reference_shift(level);
}

fn reference_nearest(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let position = vastex_position_from_uv(uv);
    // Inside of the picture whole numbers say which texel it is, unless they are not at the middle of those that they cover.
    let is_beyond = (position.fraction < vec2<f32>(0.0)) | (position.fraction > vec2<f32>(1.0));
    let is_measured = is_beyond | vec2<bool>(reference_params.keeps_positions == 1u);
    let inside = vec2<i32>(position.texel / reference_scale(level));
    return reference_texel(select(inside, vec2<i32>(floor(reference_place(uv, level))), is_measured), level);
}

// Where a uv is on the ordinary texture, `shift` from there. Beyond its picture by more than half of what lies there before the
// picture begins again, a border colour goes on.
fn reference_uv(uv: vec2<f32>, shift: vec2<f32>) -> vec2<f32> {
    let folded = vec2<f32>(
        vastex_folded(uv.x, vastex_texture.address.x).x,
        vastex_folded(uv.y, vastex_texture.address.y).x,
    );
    let at = folded * reference_params.share + shift;
    let has_border = vastex_texture.address.xy == vec2<u32>(VASTEX_ADDRESS_BORDER);
    return select(at, clamp(at, vec2<f32>(-0.25), vec2<f32>(0.75)), has_border);
}

fn reference_linear(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let padded = reference_size(level);
    // Round a wrapping edge the padding is to have the first texel once more, and where it ends the last one: of a single
    // texel the sampler gets one of them.
    let wraps = vastex_texture.address.xy == vec2<u32>(VASTEX_ADDRESS_WRAP);
    if any(wraps & (padded - vec2<u32>(reference_texels(level)) == vec2<u32>(1u))) {
        return reference_blended(uv, level);
    }
    let shift = reference_shift(level) / vec2<f32>(padded);
    return textureSampleLevel(reference, reference_sampler, reference_uv(uv, shift), f32(level));
}

// What the sampler does, texel by texel.
fn reference_blended(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let at = reference_place(uv, level) - 0.5;
    let first = vec2<i32>(floor(at));
    let share = at - floor(at);
    let upper = mix(
        reference_texel(first, level), reference_texel(first + vec2<i32>(1, 0), level), share.x);
    let lower = mix(
        reference_texel(first + vec2<i32>(0, 1), level), reference_texel(first + vec2<i32>(1, 1), level), share.x);
    return mix(upper, lower, share.y);
}

// 4x4 texels of a level, read one by one.
fn reference_cubic(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let at = reference_place(uv, level) - 0.5;
    let first = vec2<i32>(floor(at)) - 1;
    let x = vastex_cubic_weights(fract(at.x));
    let y = vastex_cubic_weights(fract(at.y));
    var sum = vec4<f32>(0.0);
    for (var nth = 0; nth < 16; nth++) {
        sum += x[nth % 4] * y[nth / 4] * reference_texel(first + vec2<i32>(nth % 4, nth / 4), level);
    }
    return sum;
}

fn reference_along(uv: vec2<f32>, footprint: VastexFootprint, taps: u32, level: u32) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < taps; nth++) {
        let offset = vastex_tap_offset(footprint.axis / f32(taps), nth, taps) / vec2<f32>(vastex_texture.size.xy);
        sum += reference_linear(uv + offset, level);
    }
    return sum / f32(taps);
}

fn reference_filtered(uv: vec2<f32>, footprint: VastexFootprint, level: f32, taken: u32) -> vec4<f32> {
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        return reference_nearest(uv, taken);
    }
    if VASTEX_FILTER == VASTEX_FILTER_ANISOTROPIC {
        return reference_along(uv, footprint, vastex_tap_count(footprint.axis, level), taken);
    }
    if VASTEX_FILTER == VASTEX_FILTER_BICUBIC {
        // How far a pixel is smaller than a texel of the finest level that is sampled.
        let finest = vastex_unbiased_level(footprint.lambda) - (footprint.lambda + vastex_texture.bias);
        return mix(reference_linear(uv, taken), reference_cubic(uv, taken), clamp(finest, 0.0, 1.0));
    }
    return reference_linear(uv, taken);
}

// As an application samples an ordinary texture: by the same taps, left to the sampler at the edges. What the price of a virtual one is
// measured by.
fn ordinary_filtered(uv: vec2<f32>, footprint: VastexFootprint, taps: u32, level: u32) -> vec4<f32> {
    let share = reference_params.share;
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        let size = vec2<f32>(reference_size(level));
        return textureLoad(reference, vec2<u32>(fract(uv * share) * size), i32(level));
    }
    if VASTEX_FILTER == VASTEX_FILTER_ANISOTROPIC {
        var sum = vec4<f32>(0.0);
        for (var nth = 0u; nth < taps; nth++) {
            let offset = vastex_tap_offset(footprint.axis / f32(taps), nth, taps) / vec2<f32>(vastex_texture.size.xy);
            sum += textureSampleLevel(reference, reference_sampler, (uv + offset) * share, f32(level));
        }
        return sum / f32(taps);
    }
    return textureSampleLevel(reference, reference_sampler, uv * share, f32(level));
}

@fragment
fn shade_ordinary(surface: Surface) -> @location(0) vec4<f32> {
    let uv = surface.uv;
    let texel = uv * vec2<f32>(vastex_texture.size.xy);
    let footprint = vastex_footprint(dpdx(texel), dpdy(texel));
    let level = vastex_level(footprint.lambda);
    let taps = vastex_tap_count(footprint.axis, level);
    let finer = u32(floor(level));
    let sharp = ordinary_filtered(uv, footprint, taps, finer);
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST || VASTEX_FILTER == VASTEX_FILTER_BILINEAR {
        return scene_colour(sharp);
    }
    let coarser = min(finer + 1u, vastex_texture.level_count - 1u);
    return scene_colour(mix(sharp, ordinary_filtered(uv, footprint, taps, coarser), level - f32(finer)));
}

// The same by the adapter's own filter, to see how far its approximations are from it.
@fragment
fn shade_by_adapter(surface: Surface) -> @location(0) vec4<f32> {
    let ddx = dpdx(surface.uv) * reference_params.share;
    let ddy = dpdy(surface.uv) * reference_params.share;
    let at = reference_uv(surface.uv, vec2<f32>(0.0));
    return scene_colour(textureSampleGrad(reference, reference_sampler, at, ddx, ddy));
}

@fragment
fn shade_reference(surface: Surface) -> @location(0) vec4<f32> {
    let texel = surface.uv * vec2<f32>(vastex_texture.size.xy);
    let footprint = vastex_footprint(dpdx(texel), dpdy(texel));
    let level = vastex_level(footprint.lambda);
    let finer = u32(floor(level));
    let sharp = reference_filtered(surface.uv, footprint, level, finer);
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST || VASTEX_FILTER == VASTEX_FILTER_BILINEAR {
        return scene_colour(sharp);
    }
    let coarser = min(finer + 1u, vastex_texture.level_count - 1u);
    let blurred = reference_filtered(surface.uv, footprint, level, coarser);
    return scene_colour(mix(sharp, blurred, level - f32(finer)));
}
