// From a position and a level to a texel of the atlas: one read of a direct page table, or a probe of a hashed one.
// CPU twin: twins/lookup.rs.

// Where a position lies in the tile of its page of a level, in texels of the layer, and as far beyond the edges of the texture as it is.
fn vastex_free_tile_texel(position: VastexPosition, page: vec2<u32>, level: u32) -> vec2<f32> {
    return (vastex_texture.levels[level].origin + vastex_page_texel(position, page, level)) * vastex_pool.layer_share;
}

// The same from the first texel of the page, in texels of the level.
fn vastex_page_texel(position: VastexPosition, page: vec2<u32>, level: u32) -> vec2<f32> {
    let from_page = vec2<f32>(vastex_texel_in_page(position.texel, page, level)) + position.fraction;
    return from_page * vastex_texture.levels[level].inverse_scale + vastex_texture.levels[level].sample_offset;
}

// Where a position lies in the tile of its page of a level, in texels of the texture.
fn vastex_tile_texel(position: VastexPosition, page: vec2<u32>, level: u32) -> vec2<f32> {
    var texel = vastex_page_texel(position, page, level);
    if any(position.fraction < vec2<f32>(0.0)) || any(position.fraction > vec2<f32>(1.0)) {
        // Beyond the edges of the texture: as far as the border colour is mixed with nothing, half of the layer's texel.
        let layer_texel = vastex_pool.layer_scale; // a power of two
        let size = vastex_texture.levels[level].size;
        let end = ((size + layer_texel - 1u) & vec2<u32>(~(layer_texel - 1u))) - page * vastex_texture.page.xy;
        let reach = 0.5 * f32(layer_texel);
        texel = clamp(texel, vec2<f32>(-reach), vec2<f32>(end) + reach);
    }
    return vastex_texture.levels[level].origin + texel;
}

// A place in a slot. The quotients are those of whole numbers: a pool has at most 2^22 slots (vastex-core's POOL_SLOTS), so that the error
// of two roundings is less than the half that is added.
fn vastex_place_in_slot(slot: u32, tile_texel: vec2<f32>, level: u32, page: vec2<u32>) -> VastexPlace {
    let row = u32((f32(slot) + 0.5) * vastex_pool.inverse_slots.x); // counted through all images
    let image = u32((f32(row) + 0.5) * vastex_pool.inverse_slots.y);
    let cell = vec2<u32>(slot - row * vastex_pool.slots.x, row - image * vastex_pool.slots.y);
    let origin = cell * vastex_pool.tile;
    return VastexPlace(image, cell, origin, tile_texel * vastex_pool.layer_share, level, page);
}

// The entry of the finest resident page that covers a texel at `wanted`, a level finer than the tail, or coarser.
fn vastex_entry(texel: vec2<u32>, wanted: u32) -> u32 {
    if VASTEX_TABLES != VASTEX_TABLES_DIRECT {
        if VASTEX_TABLES == VASTEX_TABLES_HASHED || vastex_texture.table_places != 0u {
            return vastex_hashed_entry(texel, wanted);
        }
    }
    let level = max(wanted, vastex_texture.table_level);
    let page = vastex_page_from_texel(texel, level);
    let row = vastex_texture.levels[level].pages.x;
    return vastex_table_entry(vastex_texture.levels[level].first_entry + page.y * row + page.x);
}

// Where the finest resident page that covers the position at `wanted`, a level of the texture, has it.
fn vastex_place(position: VastexPosition, wanted: u32) -> VastexPlace {
    var entry = (wanted << VASTEX_ENTRY_SLOT_BITS) | vastex_texture.tail_slot;
    if wanted < vastex_texture.tail_level {
        entry = vastex_entry(position.texel, wanted);
    }
    // Measured from the origin of the page that the entry's level names, which may be an ancestor of the wanted one.
    let level = entry >> VASTEX_ENTRY_SLOT_BITS;
    let page = vastex_page_from_texel(position.texel, level);
    let slot = entry & ((1u << VASTEX_ENTRY_SLOT_BITS) - 1u);
    return vastex_place_in_slot(slot, vastex_tile_texel(position, page, level), level, page);
}
