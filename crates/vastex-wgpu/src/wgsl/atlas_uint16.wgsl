// The atlas of one channel of 16-bit data on a device that does not filter it; taps.wgsl does.

@group(VASTEX_GROUP) @binding(VASTEX_BINDING_ATLAS) var vastex_atlas: texture_2d_array<u32>;

fn vastex_atlas_texel(texel: vec2<u32>, image: u32) -> vec4<f32> {
    return vec4<f32>(f32(textureLoad(vastex_atlas, texel, image, 0).r) / 65535.0, 0.0, 0.0, 1.0);
}
