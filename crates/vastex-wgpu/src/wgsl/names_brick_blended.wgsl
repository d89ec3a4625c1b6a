// What an application's shaders sample of volumes by a filter that blends.

// What lies at a place of a brick, blended from the eight voxels around it.
fn vastex_brick_sample_NAME(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    if !brick.is_known {
        return vastexi_pool_POOL.unknown;
    }
    return vastexi_brick_tap_LAYER(brick.origin, vastexi_brick_voxel(brick, offset));
}
