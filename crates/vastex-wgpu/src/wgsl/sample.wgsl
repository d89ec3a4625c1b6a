// Sampling: what an application's shader calls in the place of textureSample.
// CPU twin: twins/sample.rs.

// The texture at `uv`, at a level computed from screen-space derivatives. Fragment stage, uniform control flow.
fn vastex_sample(uv: vec2<f32>) -> vec4<f32> {
    let texel = uv * vec2<f32>(vastex_texture.size.xy);
    return vastex_sample_texel_grad(vastex_position_from_uv(uv), dpdx(texel), dpdy(texel));
}

// The same with gradients of uv along one pixel, in any stage.
fn vastex_sample_grad(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(vastex_texture.size.xy);
    return vastex_sample_texel_grad(vastex_position_from_uv(uv), ddx * size, ddy * size);
}

// The same `level` levels coarser than level 0, in any stage; the biases of texture and pool are added.
fn vastex_sample_level(uv: vec2<f32>, level: f32) -> vec4<f32> {
    return vastex_sample_lambda(vastex_position_from_uv(uv), level);
}

// The same at a position, with gradients in texels of level 0 along one pixel.
fn vastex_sample_texel_grad(position: VastexPosition, dx: vec2<f32>, dy: vec2<f32>) -> vec4<f32> {
    return vastex_sample_lambda(position, vastex_lambda(dx, dy));
}

// The level that is sampled.
fn vastex_level(lambda: f32) -> f32 {
    let coarsest = f32(vastex_texture.level_count - 1u);
    return min(vastex_unbiased_level(lambda) + vastex_pool.bias, coarsest);
}

fn vastex_sample_lambda(position: VastexPosition, lambda: f32) -> vec4<f32> {
    let level = vastex_level(lambda);
    let finer = u32(floor(level));
    if VASTEX_FILTER == VASTEX_FILTER_NEAREST {
        return vastex_atlas_nearest(vastex_place(position, finer));
    }
    let sharp = vastex_atlas_linear(vastex_place(position, finer));
    if VASTEX_FILTER == VASTEX_FILTER_BILINEAR {
        return sharp;
    }
    let coarser = min(finer + 1u, vastex_texture.level_count - 1u);
    let blurred = vastex_atlas_linear(vastex_place(position, coarser));
    return mix(sharp, blurred, level - f32(finer));
}
