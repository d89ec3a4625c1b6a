// The atlas of a format that the device filters.

@group(VASTEX_GROUP) @binding(VASTEX_BINDING_ATLAS) var vastex_atlas: texture_2d_array<f32>;

fn vastex_atlas_nearest(place: VastexPlace) -> vec4<f32> {
    return textureLoad(vastex_atlas, vec2<u32>(floor(place.texel)), place.image, 0);
}

fn vastex_atlas_linear(place: VastexPlace) -> vec4<f32> {
    return textureSampleLevel(vastex_atlas, vastex_sampler, place.texel * vastex_pool.texel, place.image, 0.0);
}
