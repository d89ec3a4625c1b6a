// The picture, from the virtual texture. Where feedback is inline, it tells what it wants.

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    if SCENE_FOLDS_U || SCENE_FOLDS_V {
        let uv = scene_folded_uv(surface.uv);
        let wanted = vastex_feedback_wrapped(scene.ids.color, scene.ids.view, uv);
        if vastex_asked(scene.ids.view, surface.clip) {
            vastex_tell(scene.ids.view, surface.clip, wanted);
        }
        return scene_colour(vastex_sample_wrapped(scene.ids.color, uv));
    }
    let ddx = dpdx(surface.uv);
    let ddy = dpdy(surface.uv);
    if vastex_asked(scene.ids.view, surface.clip) {
        vastex_tell(scene.ids.view, surface.clip, vastex_feedback_grad(scene.ids.color, scene.ids.view, surface.uv, ddx, ddy));
    }
    return scene_colour(vastex_sample(scene.ids.color, surface.uv));
}
