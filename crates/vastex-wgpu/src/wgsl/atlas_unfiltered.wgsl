// The atlas of floats that the device does not filter; taps.wgsl does.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_2d_array<f32>;

// A texel of the slot that a place is in.
fn vastexi_texel_LAYER(place: VastexiPlace, texel: vec2<u32>) -> vec4<f32> {
    return textureLoad(vastexi_atlas_LAYER, vastexi_wholes(place.origin) + texel, place.image, 0);
}
