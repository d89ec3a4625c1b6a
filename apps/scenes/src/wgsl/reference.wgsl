// The same picture from an ordinary mip-mapped texture: the same level, by the same lines, and two explicit levels
// blended, since drivers approximate their own trilinear filter. The texture is padded to powers of two, so that texel
// i of a level covers exactly the texels 2i and 2i+1 of the level before it.

struct Reference {
    share: vec2<f32>,     // share of the padded texture that is picture
    layer_scale: u32,     // texels of the virtual texture along one of this one
    keeps_positions: u32, // 1 where texels of coarser levels lie at the first of those that they cover
}

@group(2) @binding(0) var reference: texture_2d<f32>;
@group(2) @binding(1) var reference_sampler: sampler;
@group(2) @binding(2) var<uniform> reference_params: Reference;

// How far the texels of a level lie before the middle of those that they cover, in texels of the level.
fn reference_shift(level: u32) -> f32 {
    return f32(reference_params.keeps_positions) * (0.5 - 0.5 * exp2(-f32(level)));
}

fn reference_nearest(uv: vec2<f32>, level: u32) -> vec4<f32> {
    let position = vastex_position_from_uv(uv);
    var texel = position.texel / vastex_texture.levels[level].scale.xy / reference_params.layer_scale;
    if reference_params.keeps_positions == 1u {
        let at = (vec2<f32>(position.texel) + position.fraction) * exp2(-f32(level));
        texel = vec2<u32>(floor(at + reference_shift(level)));
    }
    let size = textureDimensions(reference, i32(level));
    let wraps = vastex_texture.address.xy == vec2<u32>(VASTEX_ADDRESS_WRAP);
    return textureLoad(reference, select(min(texel, size - 1u), texel % size, wraps), i32(level));
}

fn reference_at(uv: vec2<f32>, level: u32) -> vec4<f32> {
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        return reference_nearest(uv, level);
    }
    let shift = reference_shift(level) / vec2<f32>(textureDimensions(reference, i32(level)));
    return textureSampleLevel(reference, reference_sampler, uv * reference_params.share + shift, f32(level));
}

@fragment
fn shade_reference(surface: Surface) -> @location(0) vec4<f32> {
    let texel = surface.uv * vec2<f32>(vastex_texture.size.xy);
    let level = vastex_level(vastex_lambda(dpdx(texel), dpdy(texel)));
    let finer = u32(floor(level));
    let uv = vec2<f32>(
        vastex_folded_uv(surface.uv.x, vastex_texture.address.x),
        vastex_folded_uv(surface.uv.y, vastex_texture.address.y),
    );
    let sharp = reference_at(uv, finer);
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST || VASTEX_FILTER == VASTEX_FILTER_BILINEAR {
        return scene_colour(sharp);
    }
    let coarser = min(finer + 1u, vastex_texture.level_count - 1u);
    return scene_colour(mix(sharp, reference_at(uv, coarser), level - f32(finer)));
}
