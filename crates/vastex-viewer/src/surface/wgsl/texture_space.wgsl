// Texture space: the surface where its uv lies, and the level that the picture needs there.

struct Spread {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) in_picture: vec4<f32>,
}

@vertex
fn spread(corner: Corner) -> Spread {
    return Spread(vastex_texture_space_clip(corner.uv), corner.uv, mesh_clip(corner));
}

@fragment
fn need(spread: Spread) -> @location(0) vec4<f32> {
    return vastex_texture_space_front(scene.ids.color, spread.uv, spread.in_picture, scene.picture);
}
