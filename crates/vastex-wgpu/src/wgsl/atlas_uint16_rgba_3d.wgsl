// The same for four channels.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_3d<u32>;

fn vastexi_voxel_LAYER(voxel: vec3<u32>) -> vec4<f32> {
    return vec4<f32>(textureLoad(vastexi_atlas_LAYER, voxel, 0)) / 65535.0;
}
