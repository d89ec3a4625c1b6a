// The lookup of a page table that is not filled downward: a loop up to the first ancestor that is there, to be measured beside the real one.

fn vastexi_found_0(texture: VastexiTexture, texel: vec2<u32>, wanted: u32) -> VastexiFound {
    for (var number = max(wanted, texture.table_level); number < texture.tail_level; number++) {
        let level = vastexi_level(texture, number, VASTEXI_POWERS_0);
        let entries = vastexi_entries(texture, number, level, VASTEXI_POWERS_0);
        let page = vastexi_page(level.sides, texel, VASTEXI_POWERS_0);
        let entry = vastexi_table_word_0(entries.first + (page.y * entries.row) + page.x);
        if entry != 0xffffffffu {
            return VastexiFound(entry, level);
        }
    }
    let number = max(wanted, texture.tail_level);
    let entry = (number << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
    return VastexiFound(entry, vastexi_level(texture, number, VASTEXI_POWERS_0));
}
