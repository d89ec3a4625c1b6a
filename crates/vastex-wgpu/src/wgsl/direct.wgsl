// A direct page table, which has an entry for each page: one read.

// The entry of the finest resident page that covers a texel at `wanted`, a level finer than the tail, or coarser.
fn vastexi_entry_POOL(texture: VastexiTexture, texel: vec2<u32>, wanted: u32) -> u32 {
    var number = max(wanted, texture.table_level);
    var level = vastexi_level(texture, number);
    // Commands that were recorded before the tables moved see them as they lay, where the newest levels may be missing.
    while level.first_entry >= vastexi_table_length_POOL() {
        number += 1u;
        if number >= texture.tail_level {
            return (texture.tail_level << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
        }
        level = vastexi_level(texture, number);
    }
    let page = vastexi_page(level, texel, VASTEXI_POWERS_POOL);
    return vastexi_table_word_POOL(level.first_entry + (page.y * level.row) + page.x);
}
