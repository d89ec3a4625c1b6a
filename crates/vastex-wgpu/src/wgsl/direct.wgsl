// A direct page table, which has an entry for each page: one read.

// The finest level that a lookup of level `wanted` reads: that, or a coarser one.
fn vastexi_sought_POOL(texture: VastexiTexture, wanted: u32) -> u32 {
    var finest = texture.table_level;
    let length = vastexi_table_length_POOL();
    if length < (1u << (texture.places & 31u)) {
        // Commands that were recorded before the tables moved see them as they lay, where the newest levels may be missing.
        let placement = vastexi_placement(texture.places);
        finest = select(placement.first_level, placement.former_level, length >= placement.former_end);
    }
    // A level that is no number at all becomes the coarsest.
    return min(max(wanted, finest), texture.last_level);
}

// What there is of the finest resident page that covers a texel at `wanted` or coarser.
fn vastexi_found_POOL(texture: VastexiTexture, texel: vec2<u32>, wanted: u32) -> VastexiFound {
    let sought = vastexi_sought_POOL(texture, wanted);
    var level = vastexi_level(texture, sought, VASTEXI_POWERS_POOL);
    var entry = (sought << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
    // A table has entries of a level that is finer than the tail, or none: then the tail's finest level is sought.
    if sought < texture.tail_level {
        let entries = vastexi_entries(texture, sought, level, VASTEXI_POWERS_POOL);
        let page = vastexi_page(level.sides, texel, VASTEXI_POWERS_POOL);
        entry = vastexi_table_word_POOL(entries.first + (page.y * entries.row) + page.x);
        // Mostly the page itself is resident, and what its level is like is known.
        let shown = entry >> VASTEXI_ENTRY_SLOT_BITS;
        if shown != sought {
            level = vastexi_level(texture, shown, VASTEXI_POWERS_POOL);
        }
    }
    return VastexiFound(entry, level);
}
