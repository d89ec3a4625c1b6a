// An atlas of bricks that the device does not filter.

// What is at a place of a slot: one voxel, or the eight around it by their distance.
fn vastexi_brick_tap_LAYER(origin: vec3<u32>, place: vec3<f32>, is_nearest: bool) -> vec4<f32> {
    if is_nearest {
        return vastexi_voxel_LAYER(origin + vec3<u32>(floor(place)));
    }
    return vastexi_brick_blend_LAYER(origin, place);
}
