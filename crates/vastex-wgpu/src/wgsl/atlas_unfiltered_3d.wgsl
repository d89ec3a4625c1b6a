// The atlas of bricks in floats that the device does not filter; taps_3d.wgsl does.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_3d<f32>;

fn vastexi_voxel_LAYER(voxel: vec3<u32>) -> vec4<f32> {
    return textureLoad(vastexi_atlas_LAYER, voxel, 0);
}
