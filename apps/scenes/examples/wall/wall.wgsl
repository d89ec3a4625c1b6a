// A panel of the wall: a rectangle of the picture with a part of its texture.
// The text after this one is `Textures::wgsl`.

struct Panel {
    place: vec4<f32>, // left, top, right, bottom [clip space]
    uv: vec4<f32>,    // where the part begins, and how far it goes [uv]
    texture: vec4<u32>, // its id, in x
}

@group(1) @binding(0) var<uniform> panel: Panel;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) texture: u32,
}

@vertex
fn place_feedback(@builtin(vertex_index) index: u32) -> Corner {
    let at = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    let clip = mix(panel.place.xy, panel.place.zw, at);
    let uv = panel.uv.xy + panel.uv.zw * at;
    return Corner(vastex_feedback_clip(0u, vec4<f32>(clip, 0.5, 1.0)), uv, panel.texture.x);
}

@fragment
fn want(placed: Corner) -> @location(0) vec4<u32> {
    return vastex_feedback(placed.texture, 0u, placed.uv);
}
