// The picture, from the virtual texture. Where feedback is inline, it tells what it wants.

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    if SCENE_FOLDS_U || SCENE_FOLDS_V {
        let uv = scene_folded_uv(surface.uv);
        let wanted = vastex_feedback_wrapped(uv);
        if vastex_asked(surface.clip) {
            vastex_tell(surface.clip, wanted);
        }
        return scene_colour(vastex_sample_wrapped(uv));
    }
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if vastex_asked(surface.clip) {
        vastex_tell(surface.clip, vastex_feedback_grad(surface.uv, ddx, ddy));
    }
    return scene_colour(vastex_sample(surface.uv));
}
