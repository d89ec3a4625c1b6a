// What lies beside a position: in the same tile as far as its border goes, else in the page that covers it.
// CPU twin: twins/reach.rs.

// Between which texels of the tile that has a position at a level four texels around a place are all in the tile: first.xy up to
// last.xy. Beyond the edge of the texture a place is not where the position is, so there nothing is near it.
fn vastex_tile_bounds(position: VastexPosition, level: u32) -> vec4<f32> {
    if any(position.fraction < vec2<f32>(0.0)) || any(position.fraction > vec2<f32>(1.0)) {
        return vec4<f32>(0.0);
    }
    let size = vastex_texture.levels[level].size.xy;
    var first = vastex_texture.levels[level].tail_offset.xy;
    var payload = size;
    if level < vastex_texture.tail_level {
        let page_texel = vastex_page_from_texel(position.texel, level) * vastex_texture.page.xy;
        first = vec2<u32>(0u);
        payload = min(vastex_texture.page.xy, size - page_texel);
    }
    let layer_scale = vastex_pool.layer_scale;
    let last = first / layer_scale + 2u * vastex_texture.border.xy / layer_scale
        + (payload + layer_scale - 1u) / layer_scale;
    return vec4<f32>(vec2<f32>(first / layer_scale) + 0.5, vec2<f32>(last) - 0.5);
}

// The place `offset` texels of level 0 from a position, whose own place and the bounds of whose tile are known. Beyond the edge
// of the texture it is folded where it is: the border goes on there after the level's last texel, which may cover more than is left.
fn vastex_place_near(
    position: VastexPosition,
    place: VastexPlace,
    bounds: vec4<f32>,
    offset: vec2<f32>,
    wanted: u32,
) -> VastexPlace {
    let shifted = vastex_place_shifted(place, offset);
    if vastex_is_in_tile(position, shifted, bounds, offset) {
        return shifted;
    }
    return vastex_place_beside(position, offset, wanted);
}

// So far from a place in the slot's image, whatever lies there.
fn vastex_place_shifted(place: VastexPlace, offset: vec2<f32>) -> VastexPlace {
    let scale = vec2<f32>(vastex_texture.levels[place.level].scale.xy) * f32(vastex_pool.layer_scale);
    let tile_texel = place.tile_texel + offset / scale;
    return VastexPlace(place.image, place.cell, place.origin, tile_texel, place.level);
}

// Whether that is in the tile, and the tile says what is at that offset.
fn vastex_is_in_tile(position: VastexPosition, shifted: VastexPlace, bounds: vec4<f32>, offset: vec2<f32>) -> bool {
    let before = vec2<f32>(position.texel) + position.fraction;
    let after = vec2<f32>(vastex_texture.size.xy - position.texel) - position.fraction;
    let is_inside = all(offset >= -before) && all(offset <= after);
    return is_inside && all(shifted.tile_texel >= bounds.xy) && all(shifted.tile_texel < bounds.zw);
}

// The same, looked up in the page that covers it.
fn vastex_place_beside(position: VastexPosition, offset: vec2<f32>, wanted: u32) -> VastexPlace {
    return vastex_place(vastex_position_beside(position, offset), wanted);
}

fn vastex_position_beside(position: VastexPosition, offset: vec2<f32>) -> VastexPosition {
    return vastex_position_from_fixed(position.texel, position.fraction + offset);
}
