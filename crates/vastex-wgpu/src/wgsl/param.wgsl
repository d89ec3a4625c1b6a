// The records of textures and groups in a texture: a row for each number.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_PARAMS) var vastexi_params: texture_2d<u32>;

// The `n`-th 16 bytes of a record.
fn vastexi_param(number: u32, n: u32) -> vec4<u32> {
    return textureLoad(vastexi_params, vec2<u32>(n, number), 0);
}

// Records that there are, at least 1.
fn vastexi_records() -> u32 {
    return textureDimensions(vastexi_params).y;
}
