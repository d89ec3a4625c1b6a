// What is shown at single taps of filters that reach beyond a tile, of tiles that are there at once, in the page that covers `offset` texels of level 0 from a position.
// CPU twin: twins/fade.rs.

fn vastexi_shown_beside_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    offset: vec2<f32>,
    wanted: u32,
) -> vec4<f32> {
    let beside = vastexi_position_beside(texture, position, offset);
    return vastexi_tap_LAYER(vastexi_place_POOL(texture, beside, wanted, VASTEXI_SCALE_LAYER));
}
