// The atlas of floats that the device does not filter; taps.wgsl does.

@group(VASTEX_GROUP) @binding(VASTEX_BINDING_ATLAS) var vastex_atlas: texture_2d_array<f32>;

fn vastex_atlas_texel(texel: vec2<u32>, image: u32) -> vec4<f32> {
    return textureLoad(vastex_atlas, texel, image, 0);
}
