// What an application's shaders read of volumes of labels: whole numbers of up to 64 bits, exactly as they are stored, never blended.

// The whole number of the voxel that a place of a brick lies in, of the level shown: its lower 32 bits, then the upper ones, which are 0 where
// the volume has none; 0 where there is no such volume.
fn vastex_brick_whole_NAME(brick: VastexBrick, offset: vec3<f32>) -> vec2<u32> {
    return vastex_brick_whole_at_NAME(brick, brick.base + offset * brick.scale);
}

// The same of the voxel that a place in the slot of a brick lies in [voxels of the level shown], which is brick.base + offset * brick.scale:
// for whoever goes from voxel to voxel. As far as the border of the brick those beside it are there, too; beyond that the last one goes on.
fn vastex_brick_whole_at_NAME(brick: VastexBrick, voxel: vec3<f32>) -> vec2<u32> {
    if !brick.is_known {
        return vec2<u32>(0u);
    }
    return vastexi_whole_LAYER(brick.origin + vec3<u32>(floor(clamp(voxel, brick.low, brick.high))));
}

// The whole number of the voxel that a place of a volume lies in, for one place.
fn vastex_volume_whole_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> vec2<u32> {
    return vastex_brick_whole_NAME(vastexi_brick_POOL(id, anchor, offset, level), offset);
}
