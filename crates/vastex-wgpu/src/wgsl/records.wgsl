// What a record says of a texture or a group, and of its levels; what nobody uses of it the compiler leaves out, and its reads with it.
// The mirror is in record.rs, which tells how the bits lie.

// A texture, or the shape of a group.
struct VastexiTexture {
    is_known: bool,         // whether the id names a texture that there is
    number: u32,            // in page ids
    size: vec2<u32>,        // texels of level 0
    address: vec2<u32>,     // VASTEXI_ADDRESS_*, per axis
    last_level: u32,        // the coarsest level that it has
    table_level: u32,       // the finest level that is looked up in the page table; nothing finer is resident, or the table still grows
    table_end: u32,         // entries of a page table that has all levels from table_level on; a shorter one is from before the tables moved
    former_end: u32,        // entries of the longest of those
    former_level: u32,      // the finest level that is looked up in a page table of at least former_end
    first_level: u32,       // the finest level that is looked up in a shorter one
    tail_level: u32,        // the finest level of the tail
    tail_slot: u32,
    bias: f32,              // levels added to every level computed from gradients
    finest: f32,            // the finest and the coarsest level wanted
    coarsest: f32,
    uv_finest: f32,         // the finest level of which a 32-bit uv tells the texels apart
    page_log2: u32,         // log2 of a page's texels along a side, rounded down
}

// How far a page of a level reaches.
struct VastexiSides {
    shift: vec2<u32>,       // log2 of texels, rounded down; 31 in the tail
    texels: vec2<u32>,      // texels of level 0 along a page; all there can be in the tail, whose levels are one page
}

// The entries of a level in a direct page table.
struct VastexiEntries {
    first: u32,             // where they begin
    row: u32,               // pages along x
    sides: VastexiSides,
}

// One level.
struct VastexiLevel {
    sides: VastexiSides,
    inverse_scale: vec2<f32>, // texels of the level along one of level 0
    base: vec2<f32>,        // added to a position of level 0 by that scale from the first texel of its page: the place in the tile [texels]
    origin: vec2<f32>,      // in a tile: where the level's payload begins [texels]
    size: vec2<u32>,        // of the level [texels]
    scale: vec2<u32>,       // texels of level 0 along one texel of this level
}

// A page of a texture.
struct VastexiPages {
    page: vec2<u32>,        // payload [texels]
    border: vec2<u32>,      // border on each side [texels]
}

// The texture of an id: its number, and above that which of those that have had the number.
fn vastexi_texture(id: u32) -> VastexiTexture {
    // No other record says that it is the one of this id.
    let number = min(id & VASTEXI_NUMBER_MASK, vastexi_records() - 1u);
    let shape = vastexi_param(number, 0u);
    let rule = vastexi_param(number, 1u);
    let flags = shape.w;
    return VastexiTexture(
        // 0 names nothing, as an empty record does.
        (shape.z == id) && (id != 0u),
        number,
        shape.xy,
        vec2<u32>(flags & 3u, (flags >> 2u) & 3u),
        (flags >> 4u) & 31u,
        (flags >> 9u) & 31u,
        1u << (rule.w & 31u),
        1u << ((rule.w >> 5u) & 31u),
        (rule.w >> 10u) & 31u,
        (rule.w >> 15u) & 31u,
        rule.y >> VASTEXI_ENTRY_SLOT_BITS,
        rule.y & ((1u << VASTEXI_ENTRY_SLOT_BITS) - 1u),
        bitcast<f32>(rule.x),
        f32((flags >> 14u) & 31u),
        f32((flags >> 19u) & 31u),
        f32((flags >> 24u) & 31u),
        (rule.w >> 20u) & 31u,
    );
}

// The same for functions that take a uv, which want no level finer than uv can tell.
fn vastexi_texture_by_uv(id: u32) -> VastexiTexture {
    var texture = vastexi_texture(id);
    texture.finest = max(texture.finest, texture.uv_finest);
    texture.coarsest = max(texture.coarsest, texture.uv_finest);
    return texture;
}

fn vastexi_pages(texture: VastexiTexture) -> VastexiPages {
    let pages = vastexi_param(texture.number, 2u);
    return VastexiPages(pages.xy, pages.zw);
}

// The first texel of a page, in texels of the page's level.
fn vastexi_first_texel(texture: VastexiTexture, page: vec2<u32>, powers: bool) -> vec2<u32> {
    if powers {
        return page << vec2<u32>(texture.page_log2);
    }
    return page * vastexi_pages(texture).page;
}

// The `n`-th 16 bytes of what a record has of a level.
fn vastexi_level_word(texture: VastexiTexture, level: u32, n: u32) -> vec4<u32> {
    return vastexi_param(texture.number, VASTEXI_RECORD_HEAD + (VASTEXI_RECORD_LEVEL * level) + n);
}

fn vastexi_entries(texture: VastexiTexture, level: u32) -> VastexiEntries {
    let table = vastexi_level_word(texture, level, 0u);
    let texels = vastexi_level_word(texture, level, 3u);
    return VastexiEntries(table.x, table.y, VastexiSides(table.zw, texels.xy));
}

// Texels of a level along one of level 0.
fn vastexi_inverse_scale(texture: VastexiTexture, level: u32) -> vec2<f32> {
    return bitcast<vec2<f32>>(vastexi_level_word(texture, level, 1u).xy);
}

// `powers` says whether scales and pages are known to have sides that are powers of two: then the place of a tile follows from one word,
// and compilers leave out the reads of the others.
fn vastexi_level(texture: VastexiTexture, level: u32, powers: bool) -> VastexiLevel {
    let place = bitcast<vec4<f32>>(vastexi_level_word(texture, level, 1u));
    // A shift of up to half a texel is in the base.
    let origin = floor(place.zw);
    let texels = vastexi_level_word(texture, level, 3u);
    if powers {
        let log2_scale = 127u - (bitcast<vec2<u32>>(place.xy) >> vec2<u32>(23u));
        let in_page = min(log2_scale + texture.page_log2, vec2<u32>(31u));
        let shift = select(vec2<u32>(31u), in_page, level < texture.tail_level);
        let size = ((texture.size - 1u) >> log2_scale) + 1u;
        return VastexiLevel(VastexiSides(shift, texels.xy), place.xy, place.zw, origin, size, texels.zw);
    }
    let table = vastexi_level_word(texture, level, 0u);
    let size = vastexi_level_word(texture, level, 2u).xy;
    return VastexiLevel(VastexiSides(table.zw, texels.xy), place.xy, place.zw, origin, size, texels.zw);
}

// The size of the texture of an id, in texels of level 0; 0 where the id names none.
fn vastex_size(id: u32) -> vec2<u32> {
    let texture = vastexi_texture(id);
    return select(vec2<u32>(0u), texture.size, texture.is_known);
}
