// Voxels that are not left to the device's filter: eight loads, blended in single precision, so that values stay exact.

// What is at a place of a slot: the eight voxels around it by their distance.
fn vastexi_brick_blend_LAYER(origin: vec3<u32>, place: vec3<f32>) -> vec4<f32> {
    let centred = max(place - 0.5, vec3<f32>(0.0));
    let first = floor(centred);
    let weight = centred - first;
    let a = origin + vec3<u32>(first);
    // At the last voxel of a slot the next one counts for nothing, and is another slot's.
    let b = a + select(vec3<u32>(1u), vec3<u32>(0u), weight == vec3<f32>(0.0));
    let row_00 = mix(vastexi_voxel_LAYER(a), vastexi_voxel_LAYER(vec3<u32>(b.x, a.y, a.z)), weight.x);
    let row_10 = mix(vastexi_voxel_LAYER(vec3<u32>(a.x, b.y, a.z)), vastexi_voxel_LAYER(vec3<u32>(b.xy, a.z)), weight.x);
    let row_01 = mix(vastexi_voxel_LAYER(vec3<u32>(a.xy, b.z)), vastexi_voxel_LAYER(vec3<u32>(b.x, a.y, b.z)), weight.x);
    let row_11 = mix(vastexi_voxel_LAYER(vec3<u32>(a.x, b.yz)), vastexi_voxel_LAYER(b), weight.x);
    return mix(mix(row_00, row_10, weight.y), mix(row_01, row_11, weight.y), weight.z);
}
