// The atlas of bricks of one channel of 16-bit data as two of 8 bits, of which the device filters each: the lower half first.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_3d<f32>;

fn vastexi_joined_LAYER(halves: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(dot(halves, vec2<f32>(255.0, 65280.0)) / 65535.0, 0.0, 0.0, 1.0);
}

fn vastexi_voxel_LAYER(voxel: vec3<u32>) -> vec4<f32> {
    return vastexi_joined_LAYER(textureLoad(vastexi_atlas_LAYER, voxel, 0).rg);
}

// What is at a place of a slot: the eight voxels around it by their distance.
fn vastexi_brick_tap_LAYER(origin: vec3<u32>, place: vec3<f32>) -> vec4<f32> {
    let texel = vec3<f32>(vastexi_pool_POOL.texel, vastexi_pool_POOL.texel_z);
    let atlas_place = (vec3<f32>(origin) + place) * texel;
    return vastexi_joined_LAYER(textureSampleLevel(vastexi_atlas_LAYER, vastexi_sampler, atlas_place, 0.0).rg);
}
