// The records of textures and groups, by number, in a storage buffer.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_PARAMS) var<storage, read> vastexi_params: array<vec4<u32>>;

// The `n`-th 16 bytes of a record.
fn vastexi_param(number: u32, n: u32) -> vec4<u32> {
    return vastexi_params[number * VASTEXI_RECORD_WORDS + n];
}

// Records that there are, at least 1.
fn vastexi_records() -> u32 {
    return arrayLength(&vastexi_params) / VASTEXI_RECORD_WORDS;
}
