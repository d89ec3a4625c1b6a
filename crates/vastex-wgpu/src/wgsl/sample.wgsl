// Sampling: what an application's shader calls in the place of textureSample.
// CPU twin: twins/sample.rs.

// The texture at `uv`, at a level computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_sample(uv: vec2<f32>) -> vec4<f32> {
    let texel = uv * vec2<f32>(vastex_texture.size.xy);
    return vastex_sample_texel_grad(vastex_position_from_uv(uv), dpdx(texel), dpdy(texel));
}

// The same for a uv that jumps from 1 to 0 between neighbouring pixels where a surface closes, as one that is computed in the shader
// from a direction or an angle does: along wrapping axes neighbours lie the shorter way round, less than half a turn apart.
// Fragment stage, uniform control flow.
fn vastex_sample_wrapped(uv: vec2<f32>) -> vec4<f32> {
    let dx = vastex_texels_wrapped(dpdx(uv));
    return vastex_sample_texel_grad(vastex_position_from_uv(uv), dx, vastex_texels_wrapped(dpdy(uv)));
}

// The same with gradients of uv along one pixel, in any stage.
fn vastex_sample_grad(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(vastex_texture.size.xy);
    return vastex_sample_texel_grad(vastex_position_from_uv(uv), ddx * size, ddy * size);
}

// The same `level` levels coarser than level 0, in any stage; the biases of texture and pool are added. Below 0 it says how many
// times the texture is enlarged. Whatever the filter, all axes count alike.
fn vastex_sample_level(uv: vec2<f32>, level: f32) -> vec4<f32> {
    return vastex_sample_position(vastex_position_from_uv(uv), VastexFootprint(level, vec2<f32>(0.0)));
}

// The same at a position, with gradients in texels of level 0 along one pixel.
fn vastex_sample_texel_grad(position: VastexPosition, dx: vec2<f32>, dy: vec2<f32>) -> vec4<f32> {
    let footprint = vastex_footprint(dx, dy);
    return vastex_sample_position(position, VastexFootprint(footprint.lambda, footprint.axis * position.way));
}

// The level that is sampled.
fn vastex_level(lambda: f32) -> f32 {
    let coarsest = f32(vastex_texture.level_count - 1u);
    return min(vastex_unbiased_level(lambda) + vastex_pool.bias, coarsest);
}

// What a pixel shows that covers so much around a position, the axis as the texture runs there.
fn vastex_sample_position(position: VastexPosition, footprint: VastexFootprint) -> vec4<f32> {
    return vastex_filtered(position, footprint, vastex_level(footprint.lambda));
}
