// Sampling of a kind: what the functions that applications call in the place of textureSample have in common (names_sample.wgsl).
// CPU twin: twins/sample.rs.

// What a pixel shows that covers so much around a position, the axis as the texture runs there.
fn vastexi_sample_KIND(texture: VastexiTexture, position: VastexiPosition, footprint: VastexiFootprint) -> vec4<f32> {
    if !texture.is_known {
        return vastexi_pool_POOL.unknown;
    }
    let level = vastexi_sampled_level(texture, footprint.lambda, vastexi_pool_POOL.bias);
    return vastexi_filtered_KIND(texture, position, footprint, level);
}

// The same with gradients in texels of level 0 along one pixel.
fn vastexi_sample_texels_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    dx: vec2<f32>,
    dy: vec2<f32>,
) -> vec4<f32> {
    let footprint = vastexi_footprint(dx, dy, VASTEXI_TAPS_KIND);
    let turned = VastexiFootprint(footprint.lambda, footprint.axis * position.direction);
    return vastexi_sample_KIND(texture, position, turned);
}

// One texel of the tile that is there, whatever the filter, `lambda` levels coarser than level 0.
fn vastexi_nearest_KIND(texture: VastexiTexture, position: VastexiPosition, lambda: f32) -> vec4<f32> {
    if !texture.is_known {
        return vastexi_pool_POOL.unknown;
    }
    let level = vastexi_whole(floor(vastexi_sampled_level(texture, lambda, vastexi_pool_POOL.bias)));
    let place = vastexi_place_POOL(texture, position, level, VASTEXI_SCALE_LAYER);
    return vastexi_texel_LAYER(place, vec2<u32>(floor(place.tile_texel)));
}

// What sampling goes by at a position.
fn vastexi_inspect_KIND(texture: VastexiTexture, position: VastexiPosition, lambda: f32) -> VastexInspection {
    let level = vastexi_sampled_level(texture, lambda, vastexi_pool_POOL.bias);
    let place = vastexi_place_POOL(texture, position, u32(floor(level)), VASTEXI_SCALE_LAYER);
    return vastexi_inspection(texture, position, place, lambda, level, VASTEXI_POWERS_POOL);
}
