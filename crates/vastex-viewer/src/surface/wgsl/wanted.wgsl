// The feedback pass: the same surface, the pages that it wants.

@vertex
fn place_feedback(corner: Corner) -> Surface {
    return Surface(vastex_feedback_clip(scene.ids.view, scene_clip(corner)), scene_texture_uv(corner));
}

@fragment
fn want(surface: Surface) -> @location(0) vec4<u32> {
    if SCENE_FOLDS_U || SCENE_FOLDS_V {
        return vastex_feedback_wrapped(scene.ids.color, scene.ids.view, scene_folded_uv(surface.uv));
    }
    let along = vastex_gradients(surface.clip, surface.uv);
    return vastex_feedback_grad(scene.ids.color, scene.ids.view, surface.uv, along[0], along[1]);
}
