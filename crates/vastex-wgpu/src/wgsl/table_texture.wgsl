// A page table that lies in a texture, row after row.

// One entry: a slot and, above it, the level of the page whose tile is in it.
fn vastex_table_entry(index: u32) -> u32 {
    let width = textureDimensions(vastex_table).x;
    return textureLoad(vastex_table, vec2<u32>(index % width, index / width), 0).r;
}
