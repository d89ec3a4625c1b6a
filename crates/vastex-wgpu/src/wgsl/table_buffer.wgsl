// A page table that lies in a storage buffer.

// One entry: a slot and, above it, the level of the page whose tile is in it.
fn vastex_table_entry(index: u32) -> u32 {
    return vastex_table[index];
}
