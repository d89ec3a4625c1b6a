// Sampling of a kind: what the functions that applications call in the place of textureSample have in common (names_sample.wgsl).
// CPU twin: twins/sample.rs.

// What a pixel shows that covers so much around a position, the axis as the texture runs there.
fn vastexi_sample_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    footprint: VastexiFootprint,
    is_nearest: bool,
) -> vec4<f32> {
    if !texture.is_known {
        return vastexi_pool_POOL.unknown;
    }
    let level = vastexi_sampled_level(texture, footprint.lambda, vastexi_pool_POOL.bias);
    let is_unmixed = is_nearest || vastexi_is_unmixed(texture, VASTEXI_INDEX_LAYER);
    return vastexi_filtered_KIND(texture, position, footprint, level, is_unmixed);
}

// The same with gradients in texels of level 0 along one pixel.
fn vastexi_sample_texels_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    dx: vec2<f32>,
    dy: vec2<f32>,
    is_nearest: bool,
) -> vec4<f32> {
    let most_taps = select(vastexi_most_taps(texture, VASTEXI_INDEX_LAYER, VASTEXI_TAPS_KIND), 1u, is_nearest);
    let footprint = vastexi_footprint(dx, dy, most_taps);
    let turned = VastexiFootprint(footprint.lambda, footprint.axis * position.direction);
    return vastexi_sample_KIND(texture, position, turned, is_nearest);
}

// The same with gradients of uv.
fn vastexi_sample_uv_KIND(id: u32, uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>, is_nearest: bool) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(id);
    let size = vec2<f32>(texture.size);
    return vastexi_sample_texels_KIND(texture, vastexi_position_from_uv(texture, uv), ddx * size, ddy * size, is_nearest);
}

// The same at an explicit level.
fn vastexi_sample_level_KIND(id: u32, uv: vec2<f32>, level: f32, is_nearest: bool) -> vec4<f32> {
    let texture = vastexi_texture_by_uv(id);
    let footprint = VastexiFootprint(level, vec2<f32>(0.0));
    return vastexi_sample_KIND(texture, vastexi_position_from_uv(texture, uv), footprint, is_nearest);
}

// What sampling goes by at a position.
fn vastexi_inspect_KIND(texture: VastexiTexture, position: VastexiPosition, lambda: f32) -> VastexInspection {
    let level = vastexi_sampled_level(texture, lambda, vastexi_pool_POOL.bias);
    let place = vastexi_place_POOL(texture, position, u32(floor(level)), VASTEXI_SCALE_LAYER);
    return vastexi_inspection(texture, position, place, lambda, level, VASTEXI_POWERS_POOL);
}
