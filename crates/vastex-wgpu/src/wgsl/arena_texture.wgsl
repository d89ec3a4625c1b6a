// The page tables of a pool in a texture, row after row.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_TABLE_POOL) var vastexi_table_POOL: texture_2d<u32>;

// A word of it; of a direct table an entry: a slot and, above it, the level of the page whose tile is in it.
fn vastexi_table_word_POOL(index: u32) -> u32 {
    let width = textureDimensions(vastexi_table_POOL).x;
    return textureLoad(vastexi_table_POOL, vec2<u32>(index % width, index / width), 0).r;
}

fn vastexi_table_length_POOL() -> u32 {
    let size = textureDimensions(vastexi_table_POOL);
    return size.x * size.y;
}
