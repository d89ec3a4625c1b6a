// A member of a planet from an ordinary mip-mapped texture, at the taps of the virtual one. Once for each, with its name in
// the place of MEMBER.

struct Ordinary_MEMBER {
    share: vec2<f32>,     // share of the padded texture that is picture
    layer_scale: u32,
    keeps_positions: u32,
}

@group(2) @binding(TEXTURE_BINDING) var ordinary_MEMBER: texture_2d<f32>;
@group(2) @binding(SAMPLER_BINDING) var ordinary_sampler_MEMBER: sampler;
@group(2) @binding(PARAMS_BINDING) var<uniform> ordinary_params_MEMBER: Ordinary_MEMBER;

fn planet_MEMBER(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(MEMBER_ID);
    let size = vec2<f32>(texture.size);
    let lambda = vastexi_footprint(ddx * size, ddy * size, 1u).lambda;
    let level = vastexi_sampled_level(texture, lambda, vastexi_pool_POOL_PLACE.bias);
    let folded = vec2<f32>(vastexi_folded(uv.x, texture.address.x).x, vastexi_folded(uv.y, texture.address.y).x);
    let at = folded * ordinary_params_MEMBER.share;
    let sharp = textureSampleLevel(ordinary_MEMBER, ordinary_sampler_MEMBER, at, floor(level));
    let coarser = min(floor(level) + 1.0, f32(texture.last_level));
    let blurred = textureSampleLevel(ordinary_MEMBER, ordinary_sampler_MEMBER, at, coarser);
    return mix(sharp, blurred, fract(level));
}
