// What lies beside a position: in the same tile as far as its border goes, else in the page that covers it.
// CPU twin: twins/reach.rs.

// For bicubic alone: between which texels of the tile that has a position's place four texels around a place are all in the tile, first.xy
// up to last.xy. Beyond the edge of the texture a place is not where the position is, so there nothing is near it.
fn vastexi_tile_bounds(texture: VastexiTexture, position: VastexiPosition, place: VastexiPlace, powers: bool, scale: u32) -> vec4<f32> {
    if !vastexi_is_inside(position) {
        return vec4<f32>(0.0);
    }
    let level = vastexi_level(texture, place.level, powers);
    let left = vastexi_level_size(texture, level, powers) - vastexi_first_texel(texture, place.page, powers);
    // In the tail a level is one page, whatever its size.
    let payload = select(min(left, vastexi_page_texels(texture, powers)), left, place.level >= texture.tail_level);
    let border = vec2<f32>(vastexi_border(texture));
    let first = (vastexi_origin(level) - border) / f32(scale);
    let sides = (2.0 * border + vec2<f32>(payload)) / f32(scale);
    return vec4<f32>(first + 0.5, first + select(ceil(sides), sides, scale == 1u) - 0.5);
}

// The place `offset` texels of level 0 from another in the slot's image, whatever lies there.
fn vastexi_place_shifted(place: VastexiPlace, offset: vec2<f32>) -> VastexiPlace {
    return vastexi_place_moved(place, offset * place.inverse_scale);
}

// The place `offset` texels of the layer from another in the slot's image, whatever lies there.
fn vastexi_place_moved(place: VastexiPlace, offset: vec2<f32>) -> VastexiPlace {
    let tile_texel = place.tile_texel + offset;
    return VastexiPlace(
        place.image, place.cell, place.origin, tile_texel, place.inverse_scale, place.level, place.page);
}

// Whether the tile says what is at an offset from a position, and at the one as far the other way, and so at all between them: the four
// texels around each are in the tile, whose last ones are half a texel from `end`. Beyond the edge of the texture a place is folded where it
// is: the border goes on there after the level's last texel, which may cover more than is left. Within the texture nothing is near what else
// lies in a tile, other levels in the tail's and in others what is beyond the last page's border.
fn vastexi_are_in_tile(
    texture: VastexiTexture,
    position: VastexiPosition,
    place: VastexiPlace,
    end: vec2<f32>,
    offset: vec2<f32>,
) -> bool {
    let before = vec2<f32>(position.texel) + position.fraction;
    let after = vec2<f32>(texture.size - position.texel) - position.fraction;
    let texels = abs(offset * place.inverse_scale);
    return all(abs(offset) <= min(before, after))
        & all((place.tile_texel - texels) >= vec2<f32>(0.5))
        & all((place.tile_texel + texels) < end);
}

// Whether the tile says what is at one offset from a position. Beyond an edge a place is not where the position is, so there nothing is near
// it.
fn vastexi_is_in_tile(
    texture: VastexiTexture,
    position: VastexiPosition,
    shifted: VastexiPlace,
    end: vec2<f32>,
    offset: vec2<f32>,
) -> bool {
    let before = vec2<f32>(position.texel) + position.fraction;
    let after = vec2<f32>(texture.size - position.texel) - position.fraction;
    return vastexi_is_inside(position)
        & all(offset >= -before)
        & all(offset <= after)
        & all(shifted.tile_texel >= vec2<f32>(0.5))
        & all(shifted.tile_texel < end);
}

fn vastexi_position_beside(texture: VastexiTexture, position: VastexiPosition, offset: vec2<f32>) -> VastexiPosition {
    return vastexi_position_from_fixed(texture, position.texel, position.fraction + offset);
}
