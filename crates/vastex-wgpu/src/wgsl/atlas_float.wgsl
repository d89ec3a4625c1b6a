// The atlas of a format that the device filters.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_2d_array<f32>;

fn vastexi_texel_LAYER(texel: vec2<u32>, image: u32) -> vec4<f32> {
    return textureLoad(vastexi_atlas_LAYER, texel, image, 0);
}

// What is at a place: one texel, or the four around it by their distance.
fn vastexi_tap_LAYER(place: VastexiPlace, is_nearest: bool) -> vec4<f32> {
    if is_nearest {
        return vastexi_texel_LAYER(place.origin + vec2<u32>(floor(place.tile_texel)), place.image);
    }
    let texel = vastexi_pool_POOL.texel * f32(VASTEXI_SCALE_LAYER);
    let atlas_uv = (vec2<f32>(place.origin) + place.tile_texel) * texel;
    return textureSampleLevel(vastexi_atlas_LAYER, vastexi_sampler, atlas_uv, place.image, 0.0);
}
