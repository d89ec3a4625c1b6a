// Sampling in fixed point, for textures of any size: a whole-numbered anchor that a draw is measured from, and an offset from
// it that is interpolated. An offset below 2^16 texels is known to 1/128 of one, wherever in 2^31 of them the anchor is.
// CPU twin: twins/fixed.rs.

// The texture `offset` texels of level 0 from the beginning of texel `anchor`, which is the same over the draw, at a level
// computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_sample_fixed(anchor: vec2<u32>, offset: vec2<f32>) -> vec4<f32> {
    return vastex_sample_fixed_grad(anchor, offset, dpdx(offset), dpdy(offset));
}

// The same with gradients in texels of level 0 along one pixel, in any stage.
fn vastex_sample_fixed_grad(anchor: vec2<u32>, offset: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {
    return vastex_sample_texel_grad(vastex_position_from_fixed(anchor, offset), ddx, ddy);
}

// The same `level` levels coarser than level 0, in any stage; the biases of texture and pool are added.
fn vastex_sample_fixed_level(anchor: vec2<u32>, offset: vec2<f32>, level: f32) -> vec4<f32> {
    return vastex_sample_position(vastex_position_from_fixed(anchor, offset), VastexFootprint(level, vec2<f32>(0.0)));
}
