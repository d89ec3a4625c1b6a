// A texture turned round a disc, where uv jumps between neighbouring pixels.

struct Spot { @builtin(position) clip: vec4<f32>, @location(0) at: vec2<f32> }
struct Shown { @location(0) color: vec4<f32>, @location(1) wanted: vec4<u32> }
@vertex fn corner(@builtin(vertex_index) n: u32) -> Spot {
    let at = vec2<f32>(f32(n & 1u), f32(n >> 1u)) * 2.0 - 1.0;
    return Spot(vec4<f32>(at, 0.5, 1.0), at + vec2<f32>(0.02, 0.02));
}
fn uv_at(at: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(atan2(at.y, at.x) / 6.2831853 + 0.5, 0.6 * length(at));
}
@fragment fn wrapped(spot: Spot) -> Shown {
    let uv = uv_at(spot.at);
    return Shown(vastex_sample_wrapped(ID, uv), vastex_feedback_wrapped(ID, 0u, uv));
}
@fragment fn plain(spot: Spot) -> Shown {
    let uv = uv_at(spot.at);
    return Shown(vastex_sample(ID, uv), vastex_feedback(ID, 0u, uv));
}
@fragment fn other_side(spot: Spot) -> Shown {
    let uv = uv_at(spot.at);
    let turned = vec2<f32>(fract(uv.x + 0.5), uv.y);
    let ddx = select(dpdx(uv), dpdx(turned), spot.at.x < 0.0);
    let ddy = select(dpdy(uv), dpdy(turned), spot.at.x < 0.0);
    return Shown(vastex_sample_grad(ID, uv, ddx, ddy), vastex_feedback_grad(ID, 0u, uv, ddx, ddy));
}
