// The atlas of bricks of one channel of 16-bit data on a device that does not filter it; taps_3d.wgsl does.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_3d<u32>;

fn vastexi_voxel_LAYER(voxel: vec3<u32>) -> vec4<f32> {
    return vec4<f32>(f32(textureLoad(vastexi_atlas_LAYER, voxel, 0).r) / 65535.0, 0.0, 0.0, 1.0);
}
