// What an application's shaders see of volumes. No function takes derivatives, so all may be called anywhere.

// The brick of a place at a level, which counts from the finest and need not be whole: vastex_volume_level_NAME gives what a pixel wants.
// The pool's mip bias is added.
fn vastex_brick_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBrick {
    return vastexi_brick_POOL(id, anchor, offset, level);
}

// The level that is looked up where such a level is wanted, the mip bias included; what is there may be coarser.
fn vastex_volume_whole_level_NAME(id: u32, level: f32) -> u32 {
    return vastexi_whole_level_POOL(vastexi_volume(id), level);
}
