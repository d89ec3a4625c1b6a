// The picture, from the virtual texture.

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    return scene_colour(vastex_sample(surface.uv));
}
