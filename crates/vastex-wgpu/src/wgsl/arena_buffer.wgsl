// The page tables of a pool in a storage buffer.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_TABLE_POOL) var<storage, read> vastexi_table_POOL: array<u32>;

// A word of it; of a direct table an entry: a slot and, above it, the level of the page whose tile is in it.
fn vastexi_table_word_POOL(index: u32) -> u32 {
    return vastexi_table_POOL[index];
}

fn vastexi_table_length_POOL() -> u32 {
    return arrayLength(&vastexi_table_POOL);
}
