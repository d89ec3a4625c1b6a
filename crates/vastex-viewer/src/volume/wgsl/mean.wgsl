// The mean of several pictures of a volume, whose light was added up in one target: its alpha says of how many. After this stands display.wgsl.

// Whether the target stores display values as they are.
override MEAN_ENCODES: bool;

@group(0) @binding(0) var mean_light: texture_2d<f32>;

@vertex
fn mean_fill(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0;
    return vec4<f32>(corner, 0.0, 1.0);
}

@fragment
fn mean(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let sum = textureLoad(mean_light, vec2<u32>(at.xy), 0);
    let light = sum.rgb / max(sum.a, 1.0);
    if MEAN_ENCODES {
        return vec4<f32>(display_from_light(light), 1.0);
    }
    return vec4<f32>(light, 1.0);
}
