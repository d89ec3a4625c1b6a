// Vastex: the same surfaces once more, for the feedback pass of the main view, which has the number 0.

@vertex
fn place_feedback(vertex: Vertex) -> Surface {
    var placed = surface(vertex);
    placed.clip = vastex_feedback_clip(0u, placed.clip);
    return placed;
}

@fragment
fn want(surface: Surface) -> @location(0) vec4<u32> {
    let along = vastex_gradients(surface.clip, surface.uv);
    return vastex_feedback_grad(surface.texture, 0u, surface.uv, along[0], along[1]);
}
