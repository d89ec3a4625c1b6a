// The feedback pass: the same surface, the pages that it wants.

@vertex
fn place_feedback(corner: Corner) -> Surface {
    return Surface(vastex_feedback_clip(scene_clip(corner)), corner.uv);
}

@fragment
fn want(surface: Surface) -> @location(0) vec4<u32> {
    let along = vastex_gradients(surface.clip, surface.uv);
    return vastex_feedback_grad(surface.uv, along[0], along[1]);
}
