// Taps along the longer axis of what a pixel covers, as many at each of the two levels.
// CPU twin: twins/sample.rs.
//
// The tile of the middle has them all but near its edges, where those beyond its border are looked up in their own pages: at most
// one lookup for each tap, and the same picture for every width of the border. So where the first and the last one are in the tile
// nothing is asked of those between.

fn vastex_filtered(position: VastexPosition, footprint: VastexFootprint, level: f32) -> vec4<f32> {
    let taps = VastexTaps(footprint.axis, vastex_tap_count(footprint.axis, level), 0.0);
    let finer = floor(level);
    let share = level - finer;
    // A loop, so that what is in it stands once in the program. With a share there is a coarser level.
    let levels = select(2u, 1u, share == 0.0);
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < levels; nth++) {
        let weight = select(1.0 - share, share, nth == 1u);
        sum += weight * vastex_shown(position, taps, u32(finer) + nth);
    }
    return sum;
}

// What the filter takes of the tile at a place, and around it.
fn vastex_taken(position: VastexPosition, place: VastexPlace, taps: VastexTaps, wanted: u32) -> vec4<f32> {
    let bounds = vastex_tile_bounds(position, place);
    let step = taps.axis / f32(taps.count);
    let end = vastex_tap_offset(step, taps.count - 1u, taps.count); // the first is as far
    let is_in_tile = vastex_is_in_tile(position, vastex_place_shifted(place, -end), bounds, -end)
        && vastex_is_in_tile(position, vastex_place_shifted(place, end), bounds, end);
    // Between the first and the last tap are the others.
    let near = select(0u, taps.count, is_in_tile);
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < near; nth++) {
        sum += vastex_atlas_linear(vastex_place_shifted(place, vastex_tap_offset(step, nth, taps.count)));
    }
    // One by one, looked up where they leave the tile. A software driver goes once through a loop that no pixel enters, not taps times.
    for (var nth = near; nth < taps.count; nth++) {
        let offset = vastex_tap_offset(step, nth, taps.count);
        let shifted = vastex_place_shifted(place, offset);
        if vastex_is_in_tile(position, shifted, bounds, offset) {
            sum += vastex_atlas_linear(shifted);
        } else {
            sum += vastex_shown_beside(position, offset, wanted);
        }
    }
    return sum / f32(taps.count);
}
