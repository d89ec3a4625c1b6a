// Points that are sampled in the vertex stage and shown by the fragment stage.

struct Input { uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>, level: f32, at_level: u32 }
struct Point {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) color: vec4<f32>,
    @location(1) @interpolate(flat) feedback: vec4<u32>,
}
struct Shown { @location(0) color: vec4<f32>, @location(1) feedback: vec4<u32> }
@group(1) @binding(0) var<storage, read> inputs: array<Input>;
@vertex fn sampled(@builtin(vertex_index) n: u32) -> Point {
    let in = inputs[n];
    let pixel = vec2<f32>(f32(n % SIDE), f32(n / SIDE)) + 0.5;
    let at = vec2<f32>(2.0, -2.0) * pixel / f32(SIDE) + vec2<f32>(-1.0, 1.0);
    let clip = vec4<f32>(at, 0.5, 1.0);
    if in.at_level == 1u {
        return Point(clip, vastex_sample_level(ID, in.uv, in.level), vastex_feedback_level(ID, 0u, in.uv, in.level));
    }
    return Point(
        clip, vastex_sample_grad(ID, in.uv, in.ddx, in.ddy), vastex_feedback_grad(ID, 0u, in.uv, in.ddx, in.ddy));
}
@fragment fn shown(point: Point) -> Shown {
    return Shown(point.color, point.feedback);
}
