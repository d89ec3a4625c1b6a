// A lookup in a hashed page table: one probe sequence for each level up to that of a resident page.

// What there is of the finest resident page that covers a texel at `wanted` or coarser.
fn vastexi_found_POOL(texture: VastexiTexture, texel: vec2<u32>, wanted: u32) -> VastexiFound {
    for (var number = wanted; number < texture.tail_level; number++) {
        let level = vastexi_level(texture, number, VASTEXI_POWERS_POOL);
        let page = vastexi_page(level.sides, texel, VASTEXI_POWERS_POOL);
        let entry = vastexi_hashed_page_POOL(vastexi_page_id(texture.number, page, number));
        if entry != VASTEXI_NONE {
            return VastexiFound(entry, level);
        }
    }
    // A level that is no number at all becomes the coarsest.
    let number = min(max(wanted, texture.tail_level), texture.last_level);
    let entry = (number << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
    return VastexiFound(entry, vastexi_level(texture, number, VASTEXI_POWERS_POOL));
}
