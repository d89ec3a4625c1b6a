// An atlas of bricks that the device does not filter.

// What is at a place of a slot: the eight voxels around it by their distance.
fn vastexi_brick_tap_LAYER(origin: vec3<u32>, place: vec3<f32>) -> vec4<f32> {
    return vastexi_brick_blend_LAYER(origin, place);
}
