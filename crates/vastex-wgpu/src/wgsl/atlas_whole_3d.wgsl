// The atlas of bricks of labels: whole numbers of 32 bits, or of 64 as two of them.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_ATLAS_LAYER) var vastexi_atlas_LAYER: texture_3d<u32>;

// The lower 32 bits, then the upper ones: of a format of one channel the second is 0.
fn vastexi_whole_LAYER(voxel: vec3<u32>) -> vec2<u32> {
    return textureLoad(vastexi_atlas_LAYER, voxel, 0).rg;
}
