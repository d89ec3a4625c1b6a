// The page table of a texture with too many pages for an entry each: a hash table of those that are resident, three words a
// place (the page, low half and high half, and its entry). How it is kept is told at the head of vastex-core's hashed_table.rs,
// which is the CPU twin.

// Where the probe sequence of a page begins, before the number of places is taken into account.
fn vastex_hash(page: vec2<u32>) -> u32 {
    let low = (page.x ^ vastex_texture.table_seed) * VASTEX_HASH_LOW;
    let both = ((low ^ (low >> 16u)) ^ page.y) * VASTEX_HASH_HIGH;
    let mixed = (both ^ (both >> 13u)) * VASTEX_HASH_LAST;
    return mixed ^ (mixed >> 16u);
}

// The entry of a page if that is resident, else VASTEX_NONE: one probe sequence.
fn vastex_hashed_page(page: vec2<u32>) -> u32 {
    var at = vastex_hash(page);
    for (var probe = 0u; probe < VASTEX_HASHED_PROBES; probe++) {
        let place = 3u * (at & (vastex_texture.table_places - 1u));
        let high = vastex_table_entry(place + 1u);
        if high == page.y && vastex_table_entry(place) == page.x {
            return vastex_table_entry(place + 2u);
        }
        if high == VASTEX_NONE {
            break;
        }
        at += 1u;
    }
    return VASTEX_NONE;
}

// The entry of the finest resident page that covers a texel at `wanted`, a level finer than the tail, or coarser: one probe
// sequence for each level up to it.
fn vastex_hashed_entry(texel: vec2<u32>, wanted: u32) -> u32 {
    for (var level = wanted; level < vastex_texture.tail_level; level++) {
        let entry = vastex_hashed_page(vastex_page_key(vastex_page_from_texel(texel, level), level));
        if entry != VASTEX_NONE {
            return entry;
        }
    }
    return (vastex_texture.tail_level << VASTEX_ENTRY_SLOT_BITS) | vastex_texture.tail_slot;
}
