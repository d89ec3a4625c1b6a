// Feedback for surfaces that are sampled in fixed point (sample_fixed.wgsl).
// CPU twin: twins/fixed.rs.

// What the fragment shader of the feedback pass returns. Fragment stage, uniform control flow.
fn vastex_feedback_fixed(anchor: vec2<u32>, offset: vec2<f32>) -> vec4<u32> {
    return vastex_feedback_fixed_grad(anchor, offset, dpdx(offset), dpdy(offset));
}

// The same with gradients in texels of level 0 along one pixel of the target.
fn vastex_feedback_fixed_grad(anchor: vec2<u32>, offset: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<u32> {
    return vastex_feedback_texel_grad(vastex_position_from_fixed(anchor, offset), ddx, ddy);
}

// The same for a surface sampled with vastex_sample_fixed_level; it is always wanted, even where it means one point.
fn vastex_feedback_fixed_level(anchor: vec2<u32>, offset: vec2<f32>, level: f32) -> vec4<u32> {
    return vastex_feedback_lambda(vastex_position_from_fixed(anchor, offset), level, VASTEX_FEEDBACK_WANTED);
}
