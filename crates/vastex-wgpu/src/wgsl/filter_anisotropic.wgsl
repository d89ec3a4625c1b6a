// Taps along the longer axis of what a pixel covers, as many at each of the two levels.
// CPU twin: twins/sample.rs.
//
// The tile of the middle has them all but near its edges, where those beyond its border are looked up in their own pages: at most
// one lookup for each tap, and the same picture for every width of the border. So where the first and the last one are in the tile
// nothing is asked of those between.

fn vastexi_filtered_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    footprint: VastexiFootprint,
    level: f32,
) -> vec4<f32> {
    let count = vastexi_tap_count(footprint.axis, level, VASTEXI_TAPS_KIND);
    let taps = VastexiTaps(footprint.axis, count, 0.0);
    return vastexi_levels_KIND(texture, position, taps, level);
}

// What the filter takes of the tile at a place, and around it.
fn vastexi_taken_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    place: VastexiPlace,
    taps: VastexiTaps,
    wanted: u32,
) -> vec4<f32> {
    let end_of_tile = vastexi_pool_POOL.tile_side / f32(VASTEXI_SCALE_LAYER) - 0.5;
    let step = taps.axis / f32(taps.count);
    let end = vastexi_tap_offset(step, taps.count - 1u, taps.count); // the first is as far
    // Between the first and the last tap are the others.
    let near = select(0u, taps.count, vastexi_are_in_tile(texture, position, place, end_of_tile, end));
    let step_in_tile = step * place.inverse_scale;
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < near; nth++) {
        sum += vastexi_tap_LAYER(vastexi_place_moved(place, vastexi_tap_offset(step_in_tile, nth, taps.count)));
    }
    // One by one, looked up where they leave the tile. A software driver goes once through a loop that no pixel enters, not taps times.
    for (var nth = near; nth < taps.count; nth++) {
        let offset = vastexi_tap_offset(step, nth, taps.count);
        let shifted = vastexi_place_shifted(place, offset);
        if vastexi_is_in_tile(texture, position, shifted, end_of_tile, offset) {
            sum += vastexi_tap_LAYER(shifted);
        } else {
            sum += vastexi_shown_beside_KIND(texture, position, offset, wanted);
        }
    }
    return sum / f32(taps.count);
}
