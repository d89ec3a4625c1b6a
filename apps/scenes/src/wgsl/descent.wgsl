// A globe seen from between orbit and the ground, sampled in fixed point.
// The text after this one is generated: vastex's own.

struct Descent {
    clip_from_camera: mat4x4<f32>,
    anchor: vec2<u32>, // the texel below the camera, which offsets are measured from
    texture: u32,      // its id
}

@group(1) @binding(0) var<uniform> descent: Descent;

struct Corner {
    @location(0) position: vec3<f32>, // from the camera, in altitudes
    @location(1) offset: vec2<f32>,   // texels of level 0 from the anchor
}

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) offset: vec2<f32>,
    @location(1) @interpolate(flat) anchor: vec2<u32>,
}

fn descent_clip(corner: Corner) -> vec4<f32> {
    return descent.clip_from_camera * vec4<f32>(corner.position, 1.0);
}

@vertex
fn place(corner: Corner) -> Surface {
    return Surface(descent_clip(corner), corner.offset, descent.anchor);
}

@vertex
fn place_feedback(corner: Corner) -> Surface {
    return Surface(vastex_feedback_clip(0u, descent_clip(corner)), corner.offset, descent.anchor);
}

@fragment
fn shade(surface: Surface) -> @location(0) vec4<f32> {
    return vec4<f32>(vastex_sample_fixed(descent.texture, surface.anchor, surface.offset).rgb, 1.0);
}

@fragment
fn want(surface: Surface) -> @location(0) vec4<u32> {
    let along = vastex_gradients(surface.clip, surface.offset);
    return vastex_feedback_fixed_grad(descent.texture, 0u, surface.anchor, surface.offset, along[0], along[1]);
}
