// Instances spread out in the space of their texture, for estimates there.

struct Spread {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_picture: vec4<f32>,
}
@vertex fn spread(@builtin(vertex_index) n: u32, @builtin(instance_index) instance: u32) -> Spread {
    let uv = vec2<f32>(f32(n & 1u), f32(n >> 1u));
    let size = array<f32, 3>(0.45, 1.8, 1.8)[instance];
    let aside = array<f32, 3>(0.0, 0.0, 5.0)[instance];
    let place = vec2<f32>(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y) * size + aside;
    return Spread(vastex_texture_space_clip(uv), uv, vec4<f32>(place, 0.5, 1.0));
}
@fragment fn need(spread: Spread) -> @location(0) vec4<f32> {
    return vastex_texture_space(ID, spread.uv, spread.in_picture, vec2<f32>(64.0));
}
@fragment fn need_front(spread: Spread) -> @location(0) vec4<f32> {
    return vastex_texture_space_front(ID, spread.uv * vec2<f32>(1.0, -1.0), spread.in_picture, vec2<f32>(64.0));
}
