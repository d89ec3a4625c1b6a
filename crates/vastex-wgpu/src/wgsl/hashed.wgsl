// A lookup in a hashed page table: one probe sequence for each level up to that of a resident page.

// The level from which on is looked up where `wanted` is.
fn vastexi_sought_POOL(texture: VastexiTexture, wanted: u32) -> u32 {
    return wanted;
}

// The entry of the finest resident page that covers a texel at `wanted`, a level finer than the tail, or coarser.
fn vastexi_entry_POOL(texture: VastexiTexture, texel: vec2<u32>, wanted: u32) -> u32 {
    for (var number = wanted; number < texture.tail_level; number++) {
        let page = vastexi_page(vastexi_entries(texture, number, VASTEXI_POWERS_POOL).sides, texel, VASTEXI_POWERS_POOL);
        let entry = vastexi_hashed_page_POOL(vastexi_page_id(texture.number, page, number));
        if entry != VASTEXI_NONE {
            return entry;
        }
    }
    return (texture.tail_level << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
}
