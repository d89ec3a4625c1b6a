// The atlas of a format that the device filters.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_2d_array<f32>;

// A texel of the slot that a place is in.
fn vastexi_texel_LAYER(place: VastexiPlace, texel: vec2<u32>) -> vec4<f32> {
    return textureLoad(vastexi_atlas_LAYER, vastexi_wholes(place.origin) + texel, place.image, 0);
}

// What is at a place: the four texels around it by their distance.
fn vastexi_tap_LAYER(place: VastexiPlace) -> vec4<f32> {
    let texel = vastexi_pool_POOL.texel * f32(VASTEXI_SCALE_LAYER);
    let atlas_uv = (place.origin + place.tile_texel) * texel;
    return textureSampleLevel(vastexi_atlas_LAYER, vastexi_sampler, atlas_uv, place.image, 0.0);
}
