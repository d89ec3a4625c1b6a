// The lookup of a page table that is not filled downward: a loop up to the first ancestor that is there, to be measured beside the real one.

fn vastex_entry(texel: vec2<u32>, wanted: u32) -> u32 {
    for (var level = max(wanted, vastex_texture.table_level); level < vastex_texture.tail_level; level++) {
        let page = vastex_page_from_texel(texel, level);
        let row = vastex_texture.levels[level].pages.x;
        let entry = vastex_table_entry(vastex_texture.levels[level].first_entry + page.y * row + page.x);
        if entry != VASTEX_NONE {
            return entry;
        }
    }
    return (vastex_texture.tail_level << VASTEX_ENTRY_SLOT_BITS) | vastex_texture.tail_slot;
}
