// The atlas of bricks in a format that the device filters.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_3d<f32>;

fn vastexi_voxel_LAYER(voxel: vec3<u32>) -> vec4<f32> {
    return textureLoad(vastexi_atlas_LAYER, voxel, 0);
}

// What is at a place of a slot: the eight voxels around it by their distance.
fn vastexi_brick_tap_LAYER(origin: vec3<u32>, place: vec3<f32>) -> vec4<f32> {
    let texel = vec3<f32>(vastexi_pool_POOL.texel, vastexi_pool_POOL.texel_z);
    return textureSampleLevel(vastexi_atlas_LAYER, vastexi_sampler, (vec3<f32>(origin) + place) * texel, 0.0);
}
