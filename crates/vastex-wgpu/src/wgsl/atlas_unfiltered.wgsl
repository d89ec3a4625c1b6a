// The atlas of floats that the device does not filter; taps.wgsl does.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_2d_array<f32>;

fn vastexi_texel_LAYER(texel: vec2<u32>, image: u32) -> vec4<f32> {
    return textureLoad(vastexi_atlas_LAYER, texel, image, 0);
}
