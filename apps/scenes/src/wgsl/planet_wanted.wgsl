// The feedback pass of a planet: one entry serves all of its textures.

@vertex
fn place_feedback(corner: Corner) -> Surface {
    let clip = planet.clip_from_world * vec4<f32>(corner.position, 1.0);
    return Surface(vastex_feedback_clip(0u, clip), corner.position, corner.uv);
}

@fragment
fn want(surface: Surface) -> @location(0) vec4<u32> {
    let along = vastex_gradients(surface.clip, surface.uv);
    return vastex_feedback_grad(planet.ids[0].x, 0u, surface.uv, along[0], along[1]);
}
