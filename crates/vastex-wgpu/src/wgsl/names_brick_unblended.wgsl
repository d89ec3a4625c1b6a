// What an application's shaders sample of volumes by the nearest filter, and where values may not be mixed.

// The voxel that lies at a place of a brick.
fn vastex_brick_sample_NAME(brick: VastexBrick, offset: vec3<f32>) -> vec4<f32> {
    return vastex_brick_nearest_NAME(brick, offset);
}
