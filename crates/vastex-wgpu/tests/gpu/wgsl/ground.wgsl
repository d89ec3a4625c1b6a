// A ground whose fragments sample in every way that a fragment stage can.

struct Spot { @builtin(position) clip: vec4<f32>, @location(0) uv: vec2<f32> }
struct Shown { @location(0) color: vec4<f32>, @location(1) feedback: vec4<u32> }
@vertex fn corner(@builtin(vertex_index) n: u32) -> Spot {
    let at = vec2<f32>(f32(n & 1u), f32(n >> 1u)) * 2.0 - 1.0;
    let w = 1.6 + at.y;
    return Spot(vec4<f32>(at.x * w, at.y * w, 0.5 * w, w), vec2<f32>(at.x + 0.3 * at.y, w) * 0.45);
}
@fragment fn beside(spot: Spot) -> Shown {
    let uv = spot.uv;
    let ddx = dpdx(uv);
    let ddy = dpdy(uv);
    let size = vec2<f32>(vastex_size(ID));
    let anchor = vec2<u32>(40u, 30u);
    let offset = uv * size - vec2<f32>(anchor);
    let by_uv = abs(vastex_sample(ID, uv) - vastex_sample_grad(ID, uv, ddx, ddy));
    let by_offset = abs(vastex_sample_fixed(ID, anchor, offset)
        - vastex_sample_fixed_grad(ID, anchor, offset, dpdx(offset), dpdy(offset)));
    let wanted = vastex_feedback(ID, 0u, uv) != vastex_feedback_grad(ID, 0u, uv, ddx, ddy);
    let fixed = vastex_feedback_fixed(ID, 0u, anchor, offset)
        != vastex_feedback_fixed_grad(ID, 0u, anchor, offset, dpdx(offset), dpdy(offset));
    let seen = vastex_inspect(ID, uv).shown != vastex_inspect_grad(ID, uv, ddx, ddy).shown;
    let along = vastex_gradients(spot.clip, uv);
    // From pixel to pixel they are those in the middle between two, not those at this one.
    let exact = max(length(along[0] - ddx) / length(ddx), length(along[1] - ddy) / length(ddy));
    return Shown(max(by_uv, by_offset), vec4<u32>(vec4<bool>(any(wanted), any(fixed), seen, exact > 0.1)));
}
