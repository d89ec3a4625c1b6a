// What lies beside a position: in the same tile as far as its border goes, else in the page that covers it.
// CPU twin: twins/reach.rs.

// Between which texels of the tile that has a position's place four texels around a place are all in the tile: first.xy up to
// last.xy. Beyond the edge of the texture a place is not where the position is, so there nothing is near it.
fn vastex_tile_bounds(position: VastexPosition, place: VastexPlace) -> vec4<f32> {
    if any(position.fraction < vec2<f32>(0.0)) || any(position.fraction > vec2<f32>(1.0)) {
        return vec4<f32>(0.0);
    }
    let size = vastex_texture.levels[place.level].size;
    let page = select(vastex_texture.page.xy, size, place.level >= vastex_texture.tail_level);
    let payload = min(page, size - place.page * vastex_texture.page.xy);
    let border = vec2<f32>(vastex_texture.border.xy);
    let first = (vastex_texture.levels[place.level].origin - border) * vastex_pool.layer_share;
    let sides = ceil((2.0 * border + vec2<f32>(payload)) * vastex_pool.layer_share);
    return vec4<f32>(first + 0.5, first + sides - 0.5);
}

// The place `offset` texels of level 0 from another in the slot's image, whatever lies there.
fn vastex_place_shifted(place: VastexPlace, offset: vec2<f32>) -> VastexPlace {
    let scale = vastex_texture.levels[place.level].inverse_scale * vastex_pool.layer_share;
    let tile_texel = place.tile_texel + offset * scale;
    return VastexPlace(place.image, place.cell, place.origin, tile_texel, place.level, place.page);
}

// Whether that is in the tile, whose bounds are known, and the tile says what is at that offset. Beyond the edge of the texture a place is
// folded where it is: the border goes on there after the level's last texel, which may cover more than is left.
fn vastex_is_in_tile(position: VastexPosition, shifted: VastexPlace, bounds: vec4<f32>, offset: vec2<f32>) -> bool {
    let before = vec2<f32>(position.texel) + position.fraction;
    let after = vec2<f32>(vastex_texture.size.xy - position.texel) - position.fraction;
    let is_inside = all(offset >= -before) && all(offset <= after);
    return is_inside && all(shifted.tile_texel >= bounds.xy) && all(shifted.tile_texel < bounds.zw);
}

// What is `offset` texels of level 0 from a position, looked up in the page that covers it.
fn vastex_place_beside(position: VastexPosition, offset: vec2<f32>, wanted: u32) -> VastexPlace {
    return vastex_place(vastex_position_beside(position, offset), wanted);
}

fn vastex_position_beside(position: VastexPosition, offset: vec2<f32>) -> VastexPosition {
    return vastex_position_from_fixed(position.texel, position.fraction + offset);
}
