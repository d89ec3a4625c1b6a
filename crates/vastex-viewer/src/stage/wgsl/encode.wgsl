// A picture of light, told in 8 bits: the format of the target encodes it, or this does. After this stands display.wgsl.

// Whether the target stores display values as they are.
override ENCODE_IN_SHADER: bool;

@group(0) @binding(0) var encode_light: texture_2d<f32>;

@vertex
fn encode_fill(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0;
    return vec4<f32>(corner, 0.0, 1.0);
}

@fragment
fn encode(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = textureLoad(encode_light, vec2<u32>(at.xy), 0);
    if ENCODE_IN_SHADER {
        return vec4<f32>(display_from_light(pixel.rgb), pixel.a);
    }
    return pixel;
}
