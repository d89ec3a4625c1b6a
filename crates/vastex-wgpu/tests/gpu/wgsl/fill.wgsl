// Pixels along a row.
override WIDTH: u32;
@group(0) @binding(0) var<storage, read> pixels: array<vec4<u32>>;
@vertex fn vertex(@builtin(vertex_index) n: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(n & 1u) * 4.0 - 1.0, f32(n >> 1u) * 4.0 - 1.0, 0.5, 1.0);
}
@fragment fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
    return pixels[u32(at.y) * WIDTH + u32(at.x)];
}
