// The picture, from the virtual texture. Where feedback is inline, it tells what it wants.

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if vastex_asked(surface.clip) {
        vastex_tell(surface.clip, vastex_feedback_grad(surface.uv, ddx, ddy));
    }
    return scene_colour(vastex_sample(surface.uv));
}
