// The same for single taps of filters that reach beyond a tile, `offset` texels of level 0 from a position.
// CPU twin: twins/fade.rs.

// In the tile of the position, whose place and bounds are known, if that has it, else in the page that covers it.
fn vastex_shown_near(
    position: VastexPosition,
    place: VastexPlace,
    bounds: vec4<f32>,
    offset: vec2<f32>,
    wanted: u32,
) -> vec4<f32> {
    return vastex_atlas_linear(vastex_place_near(position, place, bounds, offset, wanted));
}

// In the page that covers it.
fn vastex_shown_beside(position: VastexPosition, offset: vec2<f32>, wanted: u32) -> vec4<f32> {
    return vastex_atlas_linear(vastex_place_beside(position, offset, wanted));
}
