// Texels of a level of `size` along one pixel.

fn overlay_texels_mesh(look: Look, size: vec2<f32>) -> vec2<f32> {
    return (abs(look.ddx) + abs(look.ddy)) * size;
}

fn overlay_texels_fixed(look: Look, size: vec2<f32>) -> vec2<f32> {
    return (abs(look.ddx) + abs(look.ddy)) * (size / vec2<f32>(vastex_size(scene.ids.color)));
}
