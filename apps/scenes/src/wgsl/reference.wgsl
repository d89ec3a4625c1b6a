// The same picture from an ordinary mip-mapped texture: the same level, by the same lines, and two explicit levels
// blended, since drivers approximate their own trilinear filter. The texture is padded to powers of two, so that texel
// i of a level covers exactly the texels 2i and 2i+1 of the level before it; `reference_share` is the share of it that is picture.

@group(2) @binding(0) var reference: texture_2d<f32>;
@group(2) @binding(1) var reference_sampler: sampler;
@group(2) @binding(2) var<uniform> reference_share: vec4<f32>;

fn reference_at(uv: vec2<f32>, level: u32) -> vec4<f32> {
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        let last = textureDimensions(reference, level) - 1u;
        let texel = vastex_position_from_uv(uv).texel / vastex_texture.levels[level].scale.xy;
        return textureLoad(reference, min(texel, last), level);
    }
    return textureSampleLevel(reference, reference_sampler, uv * reference_share.xy, f32(level));
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
