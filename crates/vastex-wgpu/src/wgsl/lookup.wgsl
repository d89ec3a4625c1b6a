// From a position and a level to a texel of the atlas: one read of a direct page table, or a probe of a hashed one.
// CPU twin: twins/lookup.rs.

// Where a position lies in a level, in the level's texels from `first`, one of them; `from_first` are texels of level 0.
// Beyond its edges it goes as far as the border colour is mixed with nothing: half of the layer's texel.
fn vastex_level_texel(from_first: vec2<f32>, first: vec2<u32>, level: u32) -> vec2<f32> {
    let layer_texel = vastex_pool.layer_scale; // a power of two
    let size = vastex_texture.levels[level].size.xy;
    let end = ((size + layer_texel - 1u) & vec2<u32>(~(layer_texel - 1u))) - first;
    let reach = 0.5 * f32(layer_texel);
    let scale = vec2<f32>(vastex_texture.levels[level].scale.xy);
    let texel = from_first / scale + vastex_texture.levels[level].sample_offset.xy;
    return clamp(texel, -vec2<f32>(first) - reach, vec2<f32>(end) + reach);
}

fn vastex_place_in_slot(slot: u32, tile_texel: vec2<f32>, level: u32) -> VastexPlace {
    let nth = slot % vastex_pool.slots_per_image;
    let cell = vec2<u32>(nth % vastex_pool.columns, nth / vastex_pool.columns);
    let origin = cell * vastex_pool.tile / vastex_pool.layer_scale;
    let image = slot / vastex_pool.slots_per_image;
    return VastexPlace(image, cell, origin, tile_texel / f32(vastex_pool.layer_scale), level);
}

fn vastex_place_in_tail(position: VastexPosition, wanted: u32) -> VastexPlace {
    let level = max(wanted, vastex_texture.tail_level);
    let texel = vastex_level_texel(vec2<f32>(position.texel) + position.fraction, vec2<u32>(0u), level);
    let first = vec2<f32>(vastex_texture.levels[level].tail_offset.xy + vastex_texture.border.xy);
    return vastex_place_in_slot(vastex_texture.tail_slot, first + texel, level);
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
    if wanted >= vastex_texture.tail_level {
        return vastex_place_in_tail(position, wanted);
    }
    let entry = vastex_entry(position.texel, wanted);
    let level = entry >> VASTEX_ENTRY_SLOT_BITS;
    if level >= vastex_texture.tail_level {
        return vastex_place_in_tail(position, level);
    }
    // Measured from the origin of the page that the entry's level names, which may be an ancestor of the wanted one.
    let page_texel = vastex_page_from_texel(position.texel, level) * vastex_texture.page.xy;
    let from_page = vec2<f32>(position.texel - page_texel * vastex_texture.levels[level].scale.xy) + position.fraction;
    let tile_texel = vec2<f32>(vastex_texture.border.xy) + vastex_level_texel(from_page, page_texel, level);
    return vastex_place_in_slot(entry & ((1u << VASTEX_ENTRY_SLOT_BITS) - 1u), tile_texel, level);
}
