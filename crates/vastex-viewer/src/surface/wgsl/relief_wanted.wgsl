// The feedback pass of a displaced surface: one entry for its colour and its heights.

@vertex
fn place_relief_feedback(corner: PatchCorner) -> Surface {
    let uv = relief_uv(corner);
    let clip = scene.clip_from_world * vec4<f32>(relief_point(uv), 1.0);
    return Surface(vastex_feedback_clip(scene.ids.view, clip), uv);
}

@fragment
fn want_relief(surface: Surface) -> @location(0) vec4<u32> {
    let along = vastex_gradients(surface.clip, surface.uv);
    return relief_wanted(surface.uv, along[0], along[1]);
}
