// The same for single taps of filters that reach beyond a tile, in the page that covers `offset` texels of level 0 from a position.
// CPU twin: twins/fade.rs.

fn vastex_shown_beside(position: VastexPosition, offset: vec2<f32>, wanted: u32) -> vec4<f32> {
    return vastex_atlas_linear(vastex_place_beside(position, offset, wanted));
}
