// From a position and a level to a texel of the atlas.
// CPU twin: twins/lookup.rs.
//
// `scale` is how many texels of the texture lie along one of the layer that is sampled: 1, 2 or 4.

// A position in the tile of its page of a level, in texels of the texture. It is not clamped to the texture.
fn vastexi_free_tile_texel(level: VastexiLevel, position: VastexiPosition, page: vec2<u32>, powers: bool) -> vec2<f32> {
    let from_page = vec2<f32>(vastexi_texel_in_page(level.sides, position.texel, page, powers)) + position.fraction;
    return level.base + from_page * level.inverse_scale;
}

// As `vastexi_free_tile_texel`, clamped to half a texel of the layer beyond the edges of the texture: as far as
// the border colour is mixed with texels.
fn vastexi_tile_texel(
    texture: VastexiTexture,
    level: VastexiLevel,
    position: VastexiPosition,
    page: vec2<u32>,
    powers: bool,
    scale: u32,
) -> vec2<f32> {
    let texel = vastexi_free_tile_texel(level, position, page, powers);
    if vastexi_is_inside(position) {
        return texel;
    }
    let last = (vastexi_level_size(texture, level, powers) + scale - 1u) & vec2<u32>(~(scale - 1u));
    let end = vec2<f32>(last - vastexi_first_texel(texture, page, powers));
    let origin = vastexi_origin(level);
    let reach = 0.5 * f32(scale);
    return clamp(texel, origin - reach, origin + end + reach);
}

// A slot's column, row and image. All are whole numbers, of which floats have every one up to the 2^22 slots that a pool has at most
// (vastex-core's POOL_SLOTS): the error of two roundings is less than the half that is added.
fn vastexi_cell(pool: VastexiPool, slot: u32) -> vec3<f32> {
    let number = f32(slot);
    let row = floor((number + 0.5) * pool.inverse_slots.x); // counted through all images
    let image = floor((row + 0.5) * pool.inverse_slots.y);
    return vec3<f32>(number - (row * pool.slots_side.x), row - (image * pool.slots_side.y), image);
}

// A place in a slot.
fn vastexi_place_in_slot(
    pool: VastexiPool,
    slot: u32,
    tile_texel: vec2<f32>,
    inverse_scale: vec2<f32>,
    level: u32,
    page: vec2<u32>,
    scale: u32,
) -> VastexiPlace {
    let cell = vastexi_cell(pool, slot);
    // No image lies beyond the last: a bound that no compiler knows. Without it NVIDIA's rounds the quotient itself where the image is sampled.
    let image = min(vastexi_whole(cell.z), pool.last_image);
    let origin = cell.xy * (pool.tile_side / f32(scale));
    return VastexiPlace(image, cell.xy, origin, tile_texel / f32(scale), inverse_scale / f32(scale), level, page);
}

// The place that an entry of the page table leads to: measured from the origin of the page that the entry's level names, which may be an
// ancestor of the wanted one.
fn vastexi_place_found(
    texture: VastexiTexture,
    pool: VastexiPool,
    position: VastexiPosition,
    found: VastexiFound,
    powers: bool,
    scale: u32,
) -> VastexiPlace {
    let number = found.entry >> VASTEXI_ENTRY_SLOT_BITS;
    let slot = found.entry & ((1u << VASTEXI_ENTRY_SLOT_BITS) - 1u);
    let page = vastexi_page(found.level.sides, position.texel, powers);
    let tile_texel = vastexi_tile_texel(texture, found.level, position, page, powers, scale);
    return vastexi_place_in_slot(pool, slot, tile_texel, found.level.inverse_scale, number, page, scale);
}
