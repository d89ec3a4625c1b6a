// What an application's shaders say that they want. Derivatives are taken of uv alone, before anything is read.

// What the fragment shader of a view's feedback pass returns. Fragment stage, uniform control flow.
fn vastex_feedback_NAME(id: u32, view: u32, uv: vec2<f32>) -> vec4<u32> {
    return vastex_feedback_NAME_grad(id, view, uv, dpdx(uv), dpdy(uv));
}

// The same for a surface sampled with vastex_sample_NAME_wrapped. Fragment stage, uniform control flow.
fn vastex_feedback_NAME_wrapped(id: u32, view: u32, uv: vec2<f32>) -> vec4<u32> {
    let ddx = dpdx(uv);
    let ddy = dpdy(uv);
    let texture = vastexi_texture(id);
    return vastex_feedback_NAME_grad(id, view, uv, vastexi_wrapped(texture, ddx), vastexi_wrapped(texture, ddy));
}

// The same with gradients of uv along one pixel of the target.
fn vastex_feedback_NAME_grad(id: u32, view: u32, uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<u32> {
    let texture = vastexi_texture_by_uv(id);
    let size = vec2<f32>(texture.size);
    let position = vastexi_position_from_uv(texture, uv);
    return vastexi_feedback(texture, view, position, ddx * size, ddy * size, VASTEXI_TAPS_KIND, VASTEXI_POWERS_POOL);
}

// The same for a surface sampled with vastex_sample_NAME_level; it is always wanted, even where it means one point.
fn vastex_feedback_NAME_level(id: u32, view: u32, uv: vec2<f32>, level: f32) -> vec4<u32> {
    let texture = vastexi_texture_by_uv(id);
    let position = vastexi_position_from_uv(texture, uv);
    return vastexi_feedback_lambda(texture, position, level, VASTEX_FEEDBACK_WANTED, VASTEXI_POWERS_POOL);
}

// The same for surfaces that are sampled in fixed point. Fragment stage, uniform control flow.
fn vastex_feedback_NAME_fixed(id: u32, view: u32, anchor: vec2<u32>, offset: vec2<f32>) -> vec4<u32> {
    return vastex_feedback_NAME_fixed_grad(id, view, anchor, offset, dpdx(offset), dpdy(offset));
}

// The same with gradients in texels of level 0 along one pixel of the target.
fn vastex_feedback_NAME_fixed_grad(
    id: u32,
    view: u32,
    anchor: vec2<u32>,
    offset: vec2<f32>,
    ddx: vec2<f32>,
    ddy: vec2<f32>,
) -> vec4<u32> {
    let texture = vastexi_texture(id);
    let position = vastexi_position_from_fixed(texture, anchor, offset);
    return vastexi_feedback(texture, view, position, ddx, ddy, VASTEXI_TAPS_KIND, VASTEXI_POWERS_POOL);
}

// The same for a surface sampled with vastex_sample_NAME_fixed_level; it is always wanted, even where it means one point.
fn vastex_feedback_NAME_fixed_level(id: u32, view: u32, anchor: vec2<u32>, offset: vec2<f32>, level: f32) -> vec4<u32> {
    let texture = vastexi_texture(id);
    let position = vastexi_position_from_fixed(texture, anchor, offset);
    return vastexi_feedback_lambda(texture, position, level, VASTEX_FEEDBACK_WANTED, VASTEXI_POWERS_POOL);
}

// The level that a pixel with these gradients of uv wants, at mip bias 0.
fn vastex_level_of_NAME(id: u32, ddx: vec2<f32>, ddy: vec2<f32>) -> f32 {
    let texture = vastexi_texture_by_uv(id);
    let size = vec2<f32>(texture.size);
    return vastexi_unbiased_level(texture, vastexi_footprint(ddx * size, ddy * size, VASTEXI_TAPS_KIND).lambda);
}

// What a fragment shader in texture space returns. `clip` is where the point lies in the picture, as its vertices have it, interpolated;
// `picture` the picture's size in pixels. Fragment stage, uniform control flow.
fn vastex_texture_space_NAME(id: u32, uv: vec2<f32>, clip: vec4<f32>, picture: vec2<f32>) -> vec4<f32> {
    let along = VastexiAlong(dpdx(uv), dpdy(uv), dpdx(clip), dpdy(clip));
    let texture = vastexi_texture_by_uv(id);
    return vastexi_texture_space(texture, along, clip, picture, false, VASTEXI_TAPS_KIND);
}

// The same for surfaces that are seen from one side, that from which the texture is not mirrored.
fn vastex_texture_space_NAME_front(id: u32, uv: vec2<f32>, clip: vec4<f32>, picture: vec2<f32>) -> vec4<f32> {
    let along = VastexiAlong(dpdx(uv), dpdy(uv), dpdx(clip), dpdy(clip));
    let texture = vastexi_texture_by_uv(id);
    return vastexi_texture_space(texture, along, clip, picture, true, VASTEXI_TAPS_KIND);
}
