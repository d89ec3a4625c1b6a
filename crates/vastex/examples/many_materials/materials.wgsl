// Many materials by one shader: each instance is a rectangle of the picture with a part of its own texture.
// The text after this one is `Textures::wgsl`.

struct Rectangle {
    @location(0) place: vec4<f32>, // left, top, right, bottom [clip space]
    @location(1) uv: vec4<f32>,    // of the left and top, and of the right and bottom
    @location(2) texture: u32,     // its id
}

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) texture: u32,
}

fn rectangle_corner(index: u32, rectangle: Rectangle) -> Corner {
    let at = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    let clip = mix(rectangle.place.xy, rectangle.place.zw, at);
    return Corner(vec4<f32>(clip, 0.5, 1.0), mix(rectangle.uv.xy, rectangle.uv.zw, at), rectangle.texture);
}

@vertex
fn place(@builtin(vertex_index) index: u32, rectangle: Rectangle) -> Corner {
    return rectangle_corner(index, rectangle);
}

// The ids of neighbours differ, inside of a block of four pixels too.
@fragment
fn shade(corner: Corner) -> @location(0) vec4<f32> {
    return vastex_sample(corner.texture, corner.uv);
}

@vertex
fn place_feedback(@builtin(vertex_index) index: u32, rectangle: Rectangle) -> Corner {
    var corner = rectangle_corner(index, rectangle);
    corner.clip = vastex_feedback_clip(0u, corner.clip);
    return corner;
}

@fragment
fn want(corner: Corner) -> @location(0) vec4<u32> {
    let along = vastex_gradients(corner.clip, corner.uv);
    return vastex_feedback_grad(corner.texture, 0u, corner.uv, along[0], along[1]);
}
