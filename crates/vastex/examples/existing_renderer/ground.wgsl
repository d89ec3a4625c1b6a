// The application's own shader: a rectangle on the ground, and haze in the distance.
// The text after this one is `Textures::wgsl`, which brings the functions that begin with vastex_.

struct Camera {
    clip_from_world: mat4x4<f32>,
    eye: vec4<f32>,
    half_extent: vec4<f32>, // of the ground, x and y
    sky: vec4<f32>,
    texture: vec4<u32>, // Vastex: which texture, in x
}

@group(0) @binding(0) var<uniform> camera: Camera;

struct Ground {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) world: vec3<f32>,
    @location(2) @interpolate(flat) texture: u32, // Vastex
}

fn ground_corner(corner: u32) -> Ground {
    let uv = vec2<f32>(f32(corner & 1u), f32(corner >> 1u));
    let at = (uv * 2.0 - 1.0) * vec2<f32>(1.0, -1.0) * camera.half_extent.xy; // the image's rows run southward
    let world = vec3<f32>(at, 0.0);
    return Ground(camera.clip_from_world * vec4<f32>(world, 1.0), uv, world, camera.texture.x);
}

@vertex
fn place(@builtin(vertex_index) corner: u32) -> Ground {
    return ground_corner(corner);
}

@fragment
fn shade(ground: Ground) -> @location(0) vec4<f32> {
    let colour = vastex_sample(ground.texture, ground.uv).rgb; // Vastex: in the place of textureSample(..)
    let haze = 1.0 - exp(-0.35 * distance(ground.world, camera.eye.xyz));
    return vec4<f32>(mix(colour, camera.sky.rgb, haze), 1.0);
}

// Vastex: the same surface once more, for the feedback pass of the main view, which has the number 0.

@vertex
fn place_feedback(@builtin(vertex_index) corner: u32) -> Ground {
    var ground = ground_corner(corner);
    ground.clip = vastex_feedback_clip(0u, ground.clip);
    return ground;
}

@fragment
fn want(ground: Ground) -> @location(0) vec4<u32> {
    return vastex_feedback(ground.texture, 0u, ground.uv);
}
