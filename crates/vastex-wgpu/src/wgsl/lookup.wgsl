// From a virtual uv and a level to a texel of the atlas: one read of the page table.
// CPU twin: twins/lookup.rs.

// A texel of level 0, split so that page arithmetic is in whole numbers.
struct VastexPosition {
    texel: vec2<u32>,
    fraction: vec2<f32>, // into the texel, 0 to 1
}

// A place in the atlas.
struct VastexPlace {
    image: u32,
    origin: vec2<u32>,      // the slot's first texel
    tile_texel: vec2<f32>,  // from there, in texels
    level: u32,             // the level that lies there
}

// A coordinate folded into 0 to 1 by an address mode.
fn vastex_folded_uv(uv: f32, mode: u32) -> f32 {
    switch mode {
        case VASTEX_ADDRESS_WRAP: {
            return uv - floor(uv);
        }
        case VASTEX_ADDRESS_MIRROR: {
            let turn = uv - 2.0 * floor(0.5 * uv);
            return select(turn, 2.0 - turn, turn > 1.0);
        }
        default: {
            return clamp(uv, 0.0, 1.0);
        }
    }
}

fn vastex_position_from_uv(uv: vec2<f32>) -> VastexPosition {
    let size = vastex_texture.size.xy;
    let folded = vec2<f32>(
        vastex_folded_uv(uv.x, vastex_texture.address.x),
        vastex_folded_uv(uv.y, vastex_texture.address.y),
    );
    let texel = folded * vec2<f32>(size);
    let whole = min(vec2<u32>(floor(texel)), size - 1u);
    return VastexPosition(whole, texel - vec2<f32>(whole));
}

// The page of a level finer than the tail that covers a texel of level 0.
fn vastex_page_from_texel(texel: vec2<u32>, level: u32) -> vec2<u32> {
    let pages = vastex_texture.levels[level].pages.xy;
    return min(texel / vastex_texture.levels[level].scale.xy / vastex_texture.page.xy, pages - 1u);
}

fn vastex_place_in_slot(slot: u32, tile_texel: vec2<f32>, level: u32) -> VastexPlace {
    let cell = slot % vastex_pool.slots_per_image;
    let origin = vec2<u32>(cell % vastex_pool.columns, cell / vastex_pool.columns) * vastex_pool.tile;
    return VastexPlace(slot / vastex_pool.slots_per_image, origin, tile_texel, level);
}

fn vastex_place_in_tail(position: VastexPosition, wanted: u32) -> VastexPlace {
    let level = max(wanted, vastex_texture.tail_level);
    let scale = vec2<f32>(vastex_texture.levels[level].scale.xy);
    let level_texel = (vec2<f32>(position.texel) + position.fraction) / scale;
    let first = vec2<f32>(vastex_texture.levels[level].tail_offset.xy + vastex_texture.border.xy);
    return vastex_place_in_slot(vastex_texture.tail_slot, first + level_texel, level);
}

// Where the finest resident page that covers the position at `wanted`, a level of the texture, has it.
fn vastex_place(position: VastexPosition, wanted: u32) -> VastexPlace {
    if wanted >= vastex_texture.tail_level {
        return vastex_place_in_tail(position, wanted);
    }
    let wanted_page = vastex_page_from_texel(position.texel, wanted);
    let row = vastex_texture.levels[wanted].pages.x;
    let entry = vastex_table[vastex_texture.levels[wanted].first_entry + wanted_page.y * row + wanted_page.x];
    let level = entry >> VASTEX_ENTRY_SLOT_BITS;
    if level >= vastex_texture.tail_level {
        return vastex_place_in_tail(position, level);
    }
    // Measured from the origin of the page that the entry's level names, which may be an ancestor of the wanted one.
    let scale = vastex_texture.levels[level].scale.xy;
    let page = vastex_page_from_texel(position.texel, level);
    let from_page = vec2<f32>(position.texel - page * vastex_texture.page.xy * scale) + position.fraction;
    let page_texel = from_page / vec2<f32>(scale);
    let slot = entry & ((1u << VASTEX_ENTRY_SLOT_BITS) - 1u);
    return vastex_place_in_slot(slot, vec2<f32>(vastex_texture.border.xy) + page_texel, level);
}
