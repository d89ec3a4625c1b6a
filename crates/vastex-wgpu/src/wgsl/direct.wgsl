// A direct page table, which has an entry for each page: one read.

// The level that is looked up where `wanted` is: that, or a coarser one.
fn vastexi_sought_POOL(texture: VastexiTexture, wanted: u32) -> u32 {
    var finest = texture.table_level;
    let length = vastexi_table_length_POOL();
    if length < (1u << (texture.places & 31u)) {
        // Commands that were recorded before the tables moved see them as they lay, where the newest levels may be missing.
        let placement = vastexi_placement(texture.places);
        finest = select(placement.first_level, placement.former_level, length >= placement.former_end);
    }
    return max(wanted, finest);
}

// The entry of the finest resident page that covers a texel at `number`, a level finer than the tail, or coarser.
fn vastexi_entry_POOL(texture: VastexiTexture, texel: vec2<u32>, number: u32) -> u32 {
    let entries = vastexi_entries(texture, number, VASTEXI_POWERS_POOL);
    let page = vastexi_page(entries.sides, texel, VASTEXI_POWERS_POOL);
    return vastexi_table_word_POOL(entries.first + (page.y * entries.row) + page.x);
}
