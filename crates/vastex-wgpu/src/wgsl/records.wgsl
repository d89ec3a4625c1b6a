// What a record says of a texture or a group, and of its levels; what nobody uses of it the compiler leaves out, and its reads with it.
// The mirror is in record.rs, which tells how the bits lie.

// The bits of a float that have its exponent.
const VASTEXI_EXPONENT: u32 = 0x7f800000u;

// A texture, or the shape of a group.
struct VastexiTexture {
    is_known: bool,         // whether the id names a texture that there is
    number: u32,            // in page ids
    size: vec2<u32>,        // texels of level 0
    address: vec2<u32>,     // VASTEXI_ADDRESS_*, per axis
    repeats: bool,          // whether it wraps or is mirrored along any axis
    last_level: u32,        // the coarsest level that it has
    table_level: u32,       // the finest level that is looked up in the page table; nothing finer is resident, or the table still grows
    places: u32,            // which level that is in page tables from before they moved: see vastexi_placement
    tail_level: u32,        // the finest level of the tail
    tail_slot: u32,
    bias: f32,              // levels added to every level computed from gradients
    finest: f32,            // the finest and the coarsest level wanted
    coarsest: f32,
    uv_finest: f32,         // the finest level of which a 32-bit uv tells the texels apart
    page_log2: u32,         // log2 of a page's texels along a side, rounded down
    borders: u32,           // see vastexi_border
}

// Where to look in a page table.
struct VastexiPlacement {
    table_end: u32,         // entries of a page table that has all levels from table_level on; a shorter one is from before the tables moved
    former_end: u32,        // entries of the longest of those
    former_level: u32,      // the finest level that is looked up in a page table of at least former_end
    first_level: u32,       // the finest level that is looked up in a shorter one
}

// How far a page of a level reaches. Where sides are known to be powers of two the first is read, else the second.
struct VastexiSides {
    shift: vec2<u32>,       // log2 of texels; 31 in the tail
    texels: vec2<u32>,      // texels of level 0 along a page; all there can be in the tail, whose levels are one page
}

// The entries of a level in a direct page table.
struct VastexiEntries {
    first: u32,             // where they begin
    row: u32,               // pages along x
}

// One level.
struct VastexiLevel {
    sides: VastexiSides,
    inverse_scale: vec2<f32>, // texels of the level along one of level 0
    base: vec2<f32>,        // added to a position of level 0 by that scale from the first texel of its page: the place in the tile [texels]
    scale: vec2<u32>,       // texels of level 0 along one texel of this level; 0 where they are known to be a power of two
    first: u32,             // where its entries begin in a direct page table; 0 where nothing is known of scales
}

// What a page table has for a texel: the entry of the finest resident page, and the level of that page.
struct VastexiFound {
    entry: u32,
    level: VastexiLevel,
}

// The texture of an id: its number, and above that which of those that have had the number.
fn vastexi_texture(id: u32) -> VastexiTexture {
    // No other record says that it is the one of this id, nor does what is read where there is none.
    let number = id & VASTEXI_NUMBER_MASK;
    let shape = vastexi_param(number, 0u);
    let rule = vastexi_param(number, 1u);
    let flags = shape.w;
    return VastexiTexture(
        // 0 names nothing, as an empty record does.
        (shape.z == id) && (id != 0u),
        number,
        shape.xy,
        vec2<u32>(flags & 3u, (flags >> 2u) & 3u),
        (flags & (VASTEXI_ADDRESS_WRAP | (VASTEXI_ADDRESS_WRAP << 2u))) != 0u,
        (flags >> 4u) & 31u,
        (flags >> 9u) & 31u,
        rule.w,
        rule.y >> VASTEXI_ENTRY_SLOT_BITS,
        rule.y & ((1u << VASTEXI_ENTRY_SLOT_BITS) - 1u),
        bitcast<f32>(rule.x),
        f32((flags >> 14u) & 31u),
        f32((flags >> 19u) & 31u),
        f32((flags >> 24u) & 31u),
        (rule.w >> 20u) & 31u,
        rule.z,
    );
}

// The same for functions that take a uv, which want no level finer than uv can tell.
fn vastexi_texture_by_uv(id: u32) -> VastexiTexture {
    var texture = vastexi_texture(id);
    texture.finest = max(texture.finest, texture.uv_finest);
    texture.coarsest = max(texture.coarsest, texture.uv_finest);
    return texture;
}

// Which level is the finest that is looked up in which page table.
fn vastexi_placement(places: u32) -> VastexiPlacement {
    return VastexiPlacement(
        1u << (places & 31u),
        1u << ((places >> 5u) & 31u),
        (places >> 10u) & 31u,
        (places >> 15u) & 31u,
    );
}

// Texels of a page along its sides, without its border; where they are known to be powers of two, not to be asked of a level in the tail.
fn vastexi_page_texels(texture: VastexiTexture, powers: bool) -> vec2<u32> {
    if powers {
        return vec2<u32>(1u << texture.page_log2);
    }
    return vastexi_param(texture.number, 2u).xy;
}

// The border on each side of a page [texels].
fn vastexi_border(texture: VastexiTexture) -> vec2<u32> {
    return vec2<u32>(texture.borders & 0xffffu, texture.borders >> 16u);
}

// The first texel of a page, in texels of the page's level.
fn vastexi_first_texel(texture: VastexiTexture, page: vec2<u32>, powers: bool) -> vec2<u32> {
    if powers {
        return page << vec2<u32>(texture.page_log2);
    }
    return page * vastexi_page_texels(texture, powers);
}

// The `n`-th 16 bytes of what a record has of a level.
fn vastexi_level_word(texture: VastexiTexture, level: u32, n: u32) -> vec4<u32> {
    return vastexi_param(texture.number, VASTEXI_RECORD_HEAD + (VASTEXI_RECORD_LEVEL * level) + n);
}

// `powers` says whether scales and pages are known to have sides that are powers of two: then all follows from one word. It has the
// exponents of the inverse scales, that of y where a float has it, and below them the shifts.
fn vastexi_level(texture: VastexiTexture, level: u32, powers: bool) -> VastexiLevel {
    if powers {
        let all = vastexi_level_word(texture, level, 2u);
        let exponents = vec2<u32>(all.y << 8u, all.y) & vec2<u32>(VASTEXI_EXPONENT);
        let shift = vec2<u32>(all.y & 31u, (all.y >> 5u) & 31u);
        let sides = VastexiSides(shift, vec2<u32>(0u));
        return VastexiLevel(sides, bitcast<vec2<f32>>(exponents), bitcast<vec2<f32>>(all.zw), vec2<u32>(0u), all.x);
    }
    let place = bitcast<vec4<f32>>(vastexi_level_word(texture, level, 1u));
    let texels = vastexi_level_word(texture, level, 3u);
    return VastexiLevel(VastexiSides(vec2<u32>(0u), texels.xy), place.xy, place.zw, texels.zw, 0u);
}

// The entries of a level, of which what vastexi_level gives is known.
fn vastexi_entries(texture: VastexiTexture, number: u32, level: VastexiLevel, powers: bool) -> VastexiEntries {
    if powers {
        return VastexiEntries(level.first, ((texture.size.x - 1u) >> level.sides.shift.x) + 1u);
    }
    let table = vastexi_level_word(texture, number, 0u);
    return VastexiEntries(table.x, table.y);
}

// log2 of texels of level 0 along one of a level, which is a whole number.
fn vastexi_scale_log2(level: VastexiLevel) -> vec2<u32> {
    return 127u - (bitcast<vec2<u32>>(level.inverse_scale) >> vec2<u32>(23u));
}

// Texels of level 0 along one of a level.
fn vastexi_scale(level: VastexiLevel, powers: bool) -> vec2<u32> {
    if powers {
        return vec2<u32>(1u) << vastexi_scale_log2(level);
    }
    return level.scale;
}

// The size of a level [texels].
fn vastexi_level_size(texture: VastexiTexture, level: VastexiLevel, powers: bool) -> vec2<u32> {
    if powers {
        return ((texture.size - 1u) >> vastexi_scale_log2(level)) + 1u;
    }
    return ((texture.size - 1u) / level.scale) + 1u;
}

// Where the level's payload begins in a tile [texels].
fn vastexi_origin(level: VastexiLevel) -> vec2<f32> {
    // A shift of up to half a texel is in the base.
    return floor(level.base);
}

// The size of the texture of an id, in texels of level 0; 0 where the id names none.
fn vastex_size(id: u32) -> vec2<u32> {
    let texture = vastexi_texture(id);
    return select(vec2<u32>(0u), texture.size, texture.is_known);
}
