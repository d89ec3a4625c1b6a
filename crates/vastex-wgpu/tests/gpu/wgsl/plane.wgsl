// A plane that fills the target and writes feedback.

struct Corner { @builtin(position) clip: vec4<f32>, @location(0) uv: vec2<f32> }
@vertex fn vertex(@builtin(vertex_index) n: u32) -> Corner {
    let at = vec2<f32>(f32(n & 1u) * 4.0 - 1.0, f32(n >> 1u) * 4.0 - 1.0);
    let turned = vec2<f32>(0.83 * at.x - 0.31 * at.y, 0.29 * at.x + 0.77 * at.y);
    return Corner(vastex_feedback_clip(5u, vec4<f32>(at * 2.0, 1.0, 2.0)), turned * 0.34 + vec2<f32>(0.4937, 0.5219));
}
@fragment fn fragment(in: Corner) -> @location(0) vec4<u32> {
    return vastex_feedback(ID, 5u, in.uv);
}
