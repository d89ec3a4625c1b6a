// What the device's filter makes of a ramp in 3-D textures of several formats, at 64 places: a pixel of the first row has four of them, one of
// the second row a fifth. filters.rs has the ramp, the same places, and what follows.

@group(0) @binding(0) var filters_sampler: sampler;
@group(0) @binding(1) var filters_r8: texture_3d<f32>;
@group(0) @binding(2) var filters_r16: texture_3d<f32>;
@group(0) @binding(3) var filters_high_low: texture_3d<f32>;
@group(0) @binding(4) var filters_r16f: texture_3d<f32>;
@group(0) @binding(5) var filters_r32f: texture_3d<f32>;

@vertex
fn filters_fill(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(vec2<f32>(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn filters_try(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
    let steps = (vec3<u32>(u32(at.x)) * vec3<u32>(1u, 37u, 23u)) % vec3<u32>(64u);
    // Between the middles of the first and the last of eight texels.
    let place = (vec3<f32>(steps) * 7.0 / 64.0 + 0.5) / 8.0;
    if at.y > 1.0 {
        let r32f = textureSampleLevel(filters_r32f, filters_sampler, place, 0.0).r;
        return vec4<u32>(bitcast<u32>(r32f), 0u, 0u, 0u);
    }
    let high_low = textureSampleLevel(filters_high_low, filters_sampler, place, 0.0).rg;
    return bitcast<vec4<u32>>(vec4<f32>(
        textureSampleLevel(filters_r8, filters_sampler, place, 0.0).r,
        textureSampleLevel(filters_r16, filters_sampler, place, 0.0).r,
        dot(high_low, vec2<f32>(255.0, 65280.0)) / 65535.0,
        textureSampleLevel(filters_r16f, filters_sampler, place, 0.0).r,
    ));
}
