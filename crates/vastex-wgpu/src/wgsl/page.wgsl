// From a virtual uv, or a place in fixed point, to a position, and on to a page.
// CPU twin: twins/lookup.rs.

fn vastex_position_from_uv(uv: vec2<f32>) -> VastexPosition {
    let size = vastex_texture.size.xy;
    let x = vastex_folded(uv.x, vastex_texture.address.x);
    let y = vastex_folded(uv.y, vastex_texture.address.y);
    let texel = vec2<f32>(x.x, y.x) * vec2<f32>(size);
    let whole = min(vec2<u32>(max(floor(texel), vec2<f32>(0.0))), size - 1u);
    return VastexPosition(whole, texel - vec2<f32>(whole), vec2<f32>(x.y, y.y));
}

// The same for the place `offset` texels of level 0 after the beginning of texel `anchor`.
fn vastex_position_from_fixed(anchor: vec2<u32>, offset: vec2<f32>) -> VastexPosition {
    let size = vastex_texture.size.xy;
    let x = vastex_folded_texel(anchor.x, offset.x, size.x, vastex_texture.address.x);
    let y = vastex_folded_texel(anchor.y, offset.y, size.y, vastex_texture.address.y);
    return VastexPosition(
        vec2<u32>(x.texel, y.texel),
        vec2<f32>(x.fraction, y.fraction),
        vec2<f32>(x.way, y.way),
    );
}

// A difference of uv between neighbours in texels of level 0, along wrapping axes the shorter way round.
fn vastex_texels_wrapped(difference: vec2<f32>) -> vec2<f32> {
    let wraps = vastex_texture.address.xy == vec2<u32>(VASTEX_ADDRESS_WRAP);
    return select(difference, difference - round(difference), wraps) * vec2<f32>(vastex_texture.size.xy);
}

// The page of a level that covers a texel of level 0; of a level in the tail 0,0.
fn vastex_page_from_texel(texel: vec2<u32>, level: u32) -> vec2<u32> {
    if VASTEX_PAGES == VASTEX_PAGES_POWERS_OF_TWO {
        return texel >> vastex_texture.levels[level].page_shift;
    }
    return texel / vastex_texture.levels[level].page_texels;
}

// How far a texel of level 0 lies into that page.
fn vastex_texel_in_page(texel: vec2<u32>, page: vec2<u32>, level: u32) -> vec2<u32> {
    if VASTEX_PAGES == VASTEX_PAGES_POWERS_OF_TWO {
        return texel - (page << vastex_texture.levels[level].page_shift);
    }
    return texel - page * vastex_texture.levels[level].page_texels;
}

// The id of a page without its texture, low half first: x and y of VASTEX_COORD_BITS_2D bits each, level.
fn vastex_page_key(page: vec2<u32>, level: u32) -> vec2<u32> {
    let high = (page.y >> (32u - VASTEX_COORD_BITS_2D)) | (level << (VASTEX_LEVEL_SHIFT - 32u));
    return vec2<u32>(page.x | (page.y << VASTEX_COORD_BITS_2D), high);
}
