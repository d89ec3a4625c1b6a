// What an application's shaders say that they want of volumes.

// The level that a pixel wants that covers so many voxels of level 0 along each axis, at mip bias 0: the coarsest of which no voxel is larger
// than the pixel, and how near the next one is.
fn vastex_volume_level_NAME(id: u32, pixel: vec3<f32>) -> f32 {
    let volume = vastexi_volume(id);
    return min(max(vastexi_volume_lambda(volume, pixel) + volume.bias, volume.finest), volume.coarsest);
}

// The box of the brick that feedback names for a place and such a level.
fn vastex_volume_box_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBox {
    let volume = vastexi_volume(id);
    let number = u32(floor(min(max(level, volume.finest), volume.coarsest)));
    if number >= volume.tail_level {
        return vastexi_box(volume, anchor, number, vec3<u32>(0u));
    }
    let shape = vastexi_volume_level(volume, number);
    let page = vastexi_brick_page(volume, shape, vastexi_volume_texel(volume, anchor, offset));
    return vastexi_box(volume, anchor, number, page);
}

// A feedback pixel for a place at such a level: what the fragment shader of a view's feedback pass returns. A ray that meets several bricks
// names one of them in each frame (vastex_turn).
fn vastex_volume_feedback_NAME(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> vec4<u32> {
    return vastexi_brick_feedback(vastexi_volume(id), anchor, offset, level);
}
