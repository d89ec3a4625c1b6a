// The atlas of a format that the device filters.

@group(VASTEX_GROUP) @binding(VASTEX_BINDING_ATLAS) var vastex_atlas: texture_2d_array<f32>;

fn vastex_atlas_texel(texel: vec2<u32>, image: u32) -> vec4<f32> {
    return textureLoad(vastex_atlas, texel, image, 0);
}

fn vastex_atlas_nearest(place: VastexPlace) -> vec4<f32> {
    return vastex_atlas_texel(place.origin + vec2<u32>(floor(place.tile_texel)), place.image);
}

fn vastex_atlas_linear(place: VastexPlace) -> vec4<f32> {
    let atlas_uv = (vec2<f32>(place.origin) + place.tile_texel) * vastex_pool.texel;
    return textureSampleLevel(vastex_atlas, vastex_sampler, atlas_uv, place.image, 0.0);
}
