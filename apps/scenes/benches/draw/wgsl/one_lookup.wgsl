// Trilinear filtering with one lookup, as if a slot held a second level, to be measured beside two lookups.

@group(1) @binding(1) var second_atlas: texture_2d_array<f32>;
@group(1) @binding(2) var second_sampler: sampler;
fn vastexi_filtered_0(
    texture: VastexiTexture,
    position: VastexiPosition,
    footprint: VastexiFootprint,
    level: f32,
) -> vec4<f32> {
    let place = vastexi_place_0(texture, position, u32(floor(level)), VASTEXI_SCALE_0);
    let atlas_uv = (vec2<f32>(place.origin) + place.tile_texel) * vastexi_pool_0.texel;
    let second = clamp(level - f32(place.level), 0.0, 1.0);
    return textureSampleLevel(second_atlas, second_sampler, atlas_uv, place.image, second);
}
