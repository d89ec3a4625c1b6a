// What lies beside a position: in the same tile as far as its border goes, else in the page that covers it.
// CPU twin: twins/reach.rs.

// Between which texels of the tile that has a position's place four texels around a place are all in the tile: first.xy up to
// last.xy. Beyond the edge of the texture a place is not where the position is, so there nothing is near it.
fn vastexi_tile_bounds(texture: VastexiTexture, position: VastexiPosition, place: VastexiPlace, powers: bool, scale: u32) -> vec4<f32> {
    if any(position.fraction < vec2<f32>(0.0)) || any(position.fraction > vec2<f32>(1.0)) {
        return vec4<f32>(0.0);
    }
    let level = vastexi_level(texture, place.level, powers);
    let pages = vastexi_pages(texture);
    let page = select(pages.page, level.size, place.level >= texture.tail_level);
    let payload = min(page, level.size - place.page * pages.page);
    let border = vec2<f32>(pages.border);
    let first = (level.origin - border) / f32(scale);
    let sides = ceil((2.0 * border + vec2<f32>(payload)) / f32(scale));
    return vec4<f32>(first + 0.5, first + sides - 0.5);
}

// The place `offset` texels of level 0 from another in the slot's image, whatever lies there.
fn vastexi_place_shifted(texture: VastexiTexture, place: VastexiPlace, offset: vec2<f32>, scale: u32) -> VastexiPlace {
    let tile_texel = place.tile_texel + offset * vastexi_inverse_scale(texture, place.level) / f32(scale);
    return VastexiPlace(place.image, place.cell, place.origin, tile_texel, place.level, place.page);
}

// Whether that is in the tile, whose bounds are known, and the tile says what is at that offset. Beyond the edge of the texture a place is
// folded where it is: the border goes on there after the level's last texel, which may cover more than is left.
fn vastexi_is_in_tile(
    texture: VastexiTexture,
    position: VastexiPosition,
    shifted: VastexiPlace,
    bounds: vec4<f32>,
    offset: vec2<f32>,
) -> bool {
    let before = vec2<f32>(position.texel) + position.fraction;
    let after = vec2<f32>(texture.size - position.texel) - position.fraction;
    let is_inside = all(offset >= -before) && all(offset <= after);
    return is_inside && all(shifted.tile_texel >= bounds.xy) && all(shifted.tile_texel < bounds.zw);
}

fn vastexi_position_beside(texture: VastexiTexture, position: VastexiPosition, offset: vec2<f32>) -> VastexiPosition {
    return vastexi_position_from_fixed(texture, position.texel, position.fraction + offset);
}
