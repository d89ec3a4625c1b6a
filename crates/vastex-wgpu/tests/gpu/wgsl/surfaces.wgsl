// Surfaces one behind another, which report what they want in each feedback mode.

@group(1) @binding(0) var<storage, read> surfaces: array<vec4<f32>>;
struct Corner { @builtin(position) clip: vec4<f32>, @location(0) @interpolate(flat) nth: u32 }
@vertex fn vertex(@builtin(vertex_index) n: u32, @builtin(instance_index) nth: u32) -> Corner {
    let at = vec2<f32>(f32(n & 1u) * 4.0 - 1.0, f32(n >> 1u) * 4.0 - 1.0);
    return Corner(vec4<f32>(at, surfaces[nth].x, 1.0), nth);
}
fn wanted(corner: Corner) -> vec4<u32> {
    let turn = vastex_turn(VIEW, corner.clip, u32(surfaces[corner.nth].z));
    return vec4<u32>(corner.nth, turn, corner.nth % 8u, VASTEX_FEEDBACK_WANTED);
}
@fragment fn report(corner: Corner) -> @location(0) vec4<f32> {
    if vastex_dither(VIEW, corner.clip, surfaces[corner.nth].y) {
        vastex_report(VIEW, corner.clip, wanted(corner));
    }
    return vec4<f32>(1.0);
}
@fragment fn draw(corner: Corner) -> @location(0) vec4<u32> {
    if !vastex_dither(VIEW, corner.clip, surfaces[corner.nth].y) {
        discard;
    }
    return wanted(corner);
}
