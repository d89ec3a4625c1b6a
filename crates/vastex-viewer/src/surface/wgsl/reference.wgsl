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

// The virtual texture that the ordinary one is compared with: what Vastex knows of its levels.
fn reference_texture() -> VastexiTexture {
    return vastexi_texture_by_uv(scene.ids.color);
}

// What a pixel looks at on an ordinary texture.
struct ReferenceLook {
    uv: vec2<f32>,              // not folded
    ddx: vec2<f32>,
    ddy: vec2<f32>,
    position: VastexiPosition,  // exact where a uv is not
    is_met: bool,
}

fn reference_look_mesh(seen: Seen_mesh) -> ReferenceLook {
    let ddx = dpdx(seen.uv);
    let ddy = dpdy(seen.uv);
    return ReferenceLook(seen.uv, ddx, ddy, vastexi_position_from_uv(reference_texture(), seen.uv), true);
}

// In a texture that is no larger than an ordinary one can be, a uv is a thousandth of a texel beside its place at most.
fn reference_look_fixed(seen: Seen_fixed) -> ReferenceLook {
    let look = look_fixed(seen);
    let texture = reference_texture();
    let size = vec2<f32>(texture.size);
    let position = vastexi_position_from_fixed(texture, look.anchor, look.offset);
    let uv = (vec2<f32>(position.texel) + position.fraction) / size;
    return ReferenceLook(uv, look.ddx / size, look.ddy / size, position, look.is_met);
}

// What a pixel covers, from gradients of uv, which are taken before anything is read.
fn reference_footprint(ddx: vec2<f32>, ddy: vec2<f32>) -> VastexiFootprint {
    let texture = reference_texture();
    let size = vec2<f32>(texture.size);
    return vastexi_footprint(ddx * size, ddy * size, VASTEXI_TAPS_0);
}

// Which texel of a level of `size` stands at a whole place, of so many with the padding, whose end has the border colour.
fn reference_folded(at: i32, size: i32, padded: u32, mode: u32) -> u32 {
    switch mode {
        case VASTEXI_ADDRESS_WRAP: {
            return u32((at % size + size) % size);
        }
        case VASTEXI_ADDRESS_MIRROR: {
            let turn = (at % (2 * size) + 2 * size) % (2 * size);
            return u32(min(turn, 2 * size - 1 - turn));
        }
        case VASTEXI_ADDRESS_BORDER: {
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
    let texture = reference_texture();
    let size = vastexi_level_size(texture, vastexi_level(texture, level, false), false);
    return vec2<i32>((size + layer_scale - 1u) / layer_scale);
}

// The texel that stands at a whole place of a level, inside or beyond its edges.
fn reference_texel(at: vec2<i32>, level: u32) -> vec4<f32> {
    let size = reference_texels(level);
    let padded = reference_size(level);
    let folded = vec2<u32>(
        reference_folded(at.x, size.x, padded.x, reference_texture().address.x),
        reference_folded(at.y, size.y, padded.y, reference_texture().address.y),
    );
    return textureLoad(reference, folded, i32(level));
}

// Texels of level 0 along one texel of a level.
fn reference_scale(level: u32) -> vec2<u32> {
    return vastexi_level(reference_texture(), level, false).scale * reference_params.layer_scale;
}

// Where a uv is in a level, in its texels.
fn reference_place(uv: vec2<f32>, level: u32) -> vec2<f32> {
    let position = vastexi_position_from_uv(reference_texture(), uv);
    let at = vec2<f32>(position.texel) + position.fraction;
    return at / vec2<f32>(reference_scale(level)) + reference_shift(level);
}

fn reference_nearest(uv: vec2<f32>, position: VastexiPosition, level: u32) -> vec4<f32> {
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
        vastexi_folded(uv.x, reference_texture().address.x).x,
        vastexi_folded(uv.y, reference_texture().address.y).x,
    );
    let at = folded * reference_params.share + shift;
    let has_border = reference_texture().address == vec2<u32>(VASTEXI_ADDRESS_BORDER);
    return select(at, clamp(at, vec2<f32>(-0.25), vec2<f32>(0.75)), has_border);
}

fn reference_linear(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let padded = reference_size(level);
    // Round a wrapping edge the padding is to have the first texel once more, and where it ends the last one: of a single
    // texel the sampler gets one of them.
    let wraps = reference_texture().address == vec2<u32>(VASTEXI_ADDRESS_WRAP);
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

// Weights of the four texels around a place that lies `at`, 0 to 1, between the middle two: the cubic of Catmull and Rom.
fn reference_cubic_weights(at: f32) -> vec4<f32> {
    return vec4<f32>(
        at * (at * (1.0 - 0.5 * at) - 0.5),
        at * at * (1.5 * at - 2.5) + 1.0,
        at * (at * (2.0 - 1.5 * at) + 0.5),
        at * at * (0.5 * at - 0.5),
    );
}

// 4x4 texels of a level, read one by one.
fn reference_cubic(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let at = reference_place(uv, level) - 0.5;
    let first = vec2<i32>(floor(at)) - 1;
    let x = reference_cubic_weights(fract(at.x));
    let y = reference_cubic_weights(fract(at.y));
    var sum = vec4<f32>(0.0);
    for (var nth = 0; nth < 16; nth++) {
        sum += x[nth % 4] * y[nth / 4] * reference_texel(first + vec2<i32>(nth % 4, nth / 4), level);
    }
    return sum;
}

fn reference_along(uv: vec2<f32>, footprint: VastexiFootprint, taps: u32, level: u32) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < taps; nth++) {
        let offset = vastexi_tap_offset(footprint.axis / f32(taps), nth, taps) / vec2<f32>(reference_texture().size);
        sum += reference_linear(uv + offset, level);
    }
    return sum / f32(taps);
}

fn reference_filtered(look: ReferenceLook, footprint: VastexiFootprint, level: f32, taken: u32) -> vec4<f32> {
    let uv = look.uv;
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_NEAREST {
        return reference_nearest(uv, look.position, taken);
    }
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_ANISOTROPIC {
        return reference_along(uv, footprint, vastexi_tap_count(footprint.axis, level, VASTEXI_TAPS_0), taken);
    }
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_BICUBIC {
        // How far a pixel is smaller than a texel of the finest level that is sampled.
        let finest = vastexi_unbiased_level(reference_texture(), footprint.lambda) - (footprint.lambda + reference_texture().bias);
        return mix(reference_linear(uv, taken), reference_cubic(uv, taken), clamp(finest, 0.0, 1.0));
    }
    return reference_linear(uv, taken);
}

// As an application samples an ordinary texture: by the same taps, left to the sampler at the edges. What the price of a virtual one is
// measured by.
fn ordinary_filtered(uv: vec2<f32>, footprint: VastexiFootprint, taps: u32, level: u32) -> vec4<f32> {
    let share = reference_params.share;
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_NEAREST {
        let size = vec2<f32>(reference_size(level));
        return textureLoad(reference, vec2<u32>(fract(uv * share) * size), i32(level));
    }
    if VASTEXI_FILTER_0 == VASTEXI_FILTER_ANISOTROPIC {
        var sum = vec4<f32>(0.0);
        for (var nth = 0u; nth < taps; nth++) {
            let offset = vastexi_tap_offset(footprint.axis / f32(taps), nth, taps) / vec2<f32>(reference_texture().size);
            sum += textureSampleLevel(reference, reference_sampler, (uv + offset) * share, f32(level));
        }
        return sum / f32(taps);
    }
    return textureSampleLevel(reference, reference_sampler, uv * share, f32(level));
}
