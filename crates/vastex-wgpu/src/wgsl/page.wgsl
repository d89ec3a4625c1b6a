// From a virtual uv, or a place in fixed point, to a position, and on to a page.
// CPU twin: twins/lookup.rs.

fn vastexi_position_from_uv(texture: VastexiTexture, uv: vec2<f32>) -> VastexiPosition {
    // As vastexi_folded has it where nothing repeats.
    var folded = clamp(uv, vec2<f32>(VASTEXI_NEAR.x), vec2<f32>(VASTEXI_NEAR.y));
    var direction = vec2<f32>(1.0);
    if texture.repeats {
        let x = vastexi_folded(uv.x, texture.address.x);
        let y = vastexi_folded(uv.y, texture.address.y);
        folded = vec2<f32>(x.x, y.x);
        direction = vec2<f32>(x.y, y.y);
    }
    let texel = folded * vec2<f32>(texture.size);
    let whole = min(vec2<u32>(max(texel, vec2<f32>(0.0))), texture.size - 1u);
    return VastexiPosition(whole, texel - vec2<f32>(whole), direction);
}

// The same for the place `offset` texels of level 0 after the beginning of texel `anchor`.
fn vastexi_position_from_fixed(texture: VastexiTexture, anchor: vec2<u32>, offset: vec2<f32>) -> VastexiPosition {
    let x = vastexi_folded_texel(anchor.x, offset.x, texture.size.x, texture.address.x);
    let y = vastexi_folded_texel(anchor.y, offset.y, texture.size.y, texture.address.y);
    return VastexiPosition(
        vec2<u32>(x.texel, y.texel),
        vec2<f32>(x.fraction, y.fraction),
        vec2<f32>(x.direction, y.direction),
    );
}

// Whether a position is in the texture, not beyond an edge that is clamped or has a border colour.
fn vastexi_is_inside(position: VastexiPosition) -> bool {
    return all(position.fraction >= vec2<f32>(0.0)) & all(position.fraction <= vec2<f32>(1.0));
}

// A difference of uv between neighbours, along wrapping axes the shorter way round.
fn vastexi_wrapped(texture: VastexiTexture, difference: vec2<f32>) -> vec2<f32> {
    let wraps = texture.address == vec2<u32>(VASTEXI_ADDRESS_WRAP);
    return select(difference, difference - round(difference), wraps);
}

// The page of a level that covers a texel of level 0; of a level in the tail 0,0. `powers` says whether pages are known to have sides that
// are powers of two.
fn vastexi_page(sides: VastexiSides, texel: vec2<u32>, powers: bool) -> vec2<u32> {
    if powers {
        return texel >> sides.shift;
    }
    return texel / sides.texels;
}

// How far a texel of level 0 lies into that page.
fn vastexi_texel_in_page(sides: VastexiSides, texel: vec2<u32>, page: vec2<u32>, powers: bool) -> vec2<u32> {
    if powers {
        return texel & ~(vec2<u32>(0xffffffffu) << sides.shift);
    }
    return texel - page * sides.texels;
}

// The id of a page, low half first: x and y of VASTEXI_COORD_BITS_2D bits each, level, number of the texture.
fn vastexi_page_id(number: u32, page: vec2<u32>, level: u32) -> vec2<u32> {
    let high = (page.y >> (32u - VASTEXI_COORD_BITS_2D)) | (level << (VASTEXI_LEVEL_SHIFT - 32u));
    let low = page.x | (page.y << VASTEXI_COORD_BITS_2D);
    return vec2<u32>(low, high | (number << (VASTEXI_TEXTURE_SHIFT - 32u)));
}
