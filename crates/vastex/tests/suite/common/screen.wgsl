// The texture over the whole picture, or a column of it: uv is an affine function of the pixel.
// The text after this one is `Textures::wgsl`.

struct Mapping {
    origin: vec2<f32>,
    along_x: vec2<f32>, // uv per pixel
    along_y: vec2<f32>,
    picture: vec2<f32>, // pixels
    columns: vec4<f32>, // where the column begins and ends, 0 to 1
    ids: vec4<u32>,     // of what is shown: a texture, or a group and its first members
    last: vec4<u32>,    // one more
}

@group(1) @binding(0) var<uniform> mapping: Mapping;

// The mapping goes through the vertex stage: Mesa 22.3's software driver aborts ("stack smashing detected") when the
// fragment stage reads it from the uniform and samples at a level that follows from it.
struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) pixel: vec2<f32>,
    @location(1) @interpolate(flat) ids: vec4<u32>,
    @location(2) @interpolate(flat) last: u32,
    @location(3) @interpolate(flat) view: u32,
    @location(4) @interpolate(flat) origin: vec2<f32>,
    @location(5) @interpolate(flat) along: vec4<f32>,
}

// The number of the view is that of the instance.
fn corner(index: u32, view: u32) -> Corner {
    let x = mix(mapping.columns.x, mapping.columns.y, f32(index & 1u));
    let y = f32(index >> 1u);
    let clip = vec4<f32>(2.0 * x - 1.0, 1.0 - 2.0 * y, 0.5, 1.0);
    let along = vec4<f32>(mapping.along_x, mapping.along_y);
    let pixel = vec2<f32>(x, y) * mapping.picture;
    return Corner(clip, pixel, mapping.ids, mapping.last.x, view, mapping.origin, along);
}

// From the centre of the pixel, so that what interpolation gets wrong does not matter.
fn uv_from_pixel(placed: Corner) -> vec2<f32> {
    let centre = floor(placed.pixel) + 0.5;
    return placed.origin + placed.along.xy * centre.x + placed.along.zw * centre.y;
}

@vertex
fn place(@builtin(vertex_index) index: u32, @builtin(instance_index) view: u32) -> Corner {
    return corner(index, view);
}

@vertex
fn place_feedback(@builtin(vertex_index) index: u32, @builtin(instance_index) view: u32) -> Corner {
    var placed = corner(index, view);
    placed.clip = vastex_feedback_clip(view, placed.clip);
    return placed;
}

@fragment
fn shade(placed: Corner) -> @location(0) vec4<f32> {
    return vastex_sample(placed.ids.x, uv_from_pixel(placed));
}

@fragment
fn want(placed: Corner) -> @location(0) vec4<u32> {
    return vastex_feedback(placed.ids.x, placed.view, uv_from_pixel(placed));
}
