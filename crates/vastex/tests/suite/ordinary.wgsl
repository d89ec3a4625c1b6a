// What stands behind the shader of the example `four_groups` in the place of Vastex's text where its materials have ordinary textures.

@group(2) @binding(1) var image: texture_2d<f32>;
@group(2) @binding(2) var image_sampler: sampler;

// The level is said, since WebGPU leaves to adapters how they find it.
fn vastex_sample(id: u32, uv: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(image));
    let ddx = dpdx(uv) * size;
    let ddy = dpdy(uv) * size;
    let level = 0.5 * log2(max(max(dot(ddx, ddx), dot(ddy, ddy)), 1e-30));
    return textureSampleLevel(image, image_sampler, uv, level);
}
