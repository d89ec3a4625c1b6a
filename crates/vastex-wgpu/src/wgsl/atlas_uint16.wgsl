// The atlas of one channel of 16-bit data on a device that does not filter it; taps.wgsl does.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_2d_array<u32>;

// A texel of the slot that a place is in.
fn vastexi_texel_LAYER(place: VastexiPlace, texel: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(f32(textureLoad(vastexi_atlas_LAYER, vastexi_wholes(place.origin) + texel, place.image, 0).r) / 65535.0, 0.0, 0.0, 1.0);
}
