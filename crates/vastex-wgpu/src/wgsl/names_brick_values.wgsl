// What an application's shaders sample of volumes whose values are shares or floats.

// The least and the largest value that can be sampled in a brick, of the voxels that are shown in it, border included. Where nothing is known of
// them, -3.4e38 and 3.4e38. Costs one read of a texture.
fn vastex_brick_range_NAME(brick: VastexBrick) -> vec2<f32> {
    if !brick.is_known {
        return vastexi_pool_POOL.unknown.xx;
    }
    return vastexi_brick_range_POOL(brick);
}

// What lies at a place of a brick, blended from the eight voxels around it by the shader in single precision, whatever the device filters:
// exact, and several times as slow as vastex_brick_sample_NAME.
fn vastex_brick_exact_NAME(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    if !brick.is_known {
        return vastexi_pool_POOL.unknown;
    }
    return vastexi_brick_blend_LAYER(brick.origin, vastexi_brick_voxel(brick, offset));
}

// The voxel that lies at a place of a brick.
fn vastex_brick_nearest_NAME(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    if !brick.is_known {
        return vastexi_pool_POOL.unknown;
    }
    return vastexi_voxel_LAYER(brick.origin + vec3<u32>(floor(vastexi_brick_voxel(brick, offset))));
}

// What lies at a place of a volume, for one sample: a slice, a fog. A ray looks a brick up once for all of its samples there.
fn vastex_volume_sample_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> vec4<f32> {
    return vastex_brick_sample_NAME(vastexi_brick_POOL(id, anchor, offset, level), offset);
}
