// A direct page table, which has an entry for each page: one read.

// The entry of the finest resident page that covers a texel at `wanted`, a level finer than the tail, or coarser.
fn vastexi_entry_POOL(texture: VastexiTexture, texel: vec2<u32>, wanted: u32) -> u32 {
    // Commands that were recorded before the tables moved see them as they lay, where the newest levels may be missing.
    let length = vastexi_table_length_POOL();
    let former = select(texture.first_level, texture.former_level, length >= texture.former_end);
    let number = max(wanted, select(former, texture.table_level, length >= texture.table_end));
    if number >= texture.tail_level {
        return (texture.tail_level << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
    }
    let entries = vastexi_entries(texture, number);
    let page = vastexi_page(entries.sides, texel, VASTEXI_POWERS_POOL);
    return vastexi_table_word_POOL(entries.first + (page.y * entries.row) + page.x);
}
