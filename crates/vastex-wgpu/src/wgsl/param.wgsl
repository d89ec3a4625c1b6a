// The records of textures and groups in a texture: a row for each number.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_PARAMS) var vastexi_params: texture_2d<u32>;

// The `n`-th 16 bytes of a record; of a number beyond the last one whatever WGSL gives where a texture has nothing, which is no record's
// head with the number's id. (OpenGL before 4.3 leaves it open; only ids that no texture ever had lie beyond.)
fn vastexi_param(number: u32, n: u32) -> vec4<u32> {
    return textureLoad(vastexi_params, vec2<u32>(n, number), 0);
}
