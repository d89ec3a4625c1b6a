// Sampling behind a condition that differs from pixel to pixel: gradients are taken in front of it. The same with functions that take
// derivatives themselves in the place of these browsers refuse; other compilers take it.

struct Surface {
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) id: u32,
    @location(2) @interpolate(flat) kind: u32,
}

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if surface.kind == 1u {
        return vastex_sample_grad(surface.id, surface.uv, ddx, ddy);
    }
    return vec4<f32>(0.0, 0.0, 0.0, 1.0);
}

@fragment
fn want(surface: Surface) -> @location(0) vec4<u32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if surface.kind == 1u {
        return vastex_feedback_grad(surface.id, 0u, surface.uv, ddx, ddy);
    }
    return vec4<u32>(0u);
}
