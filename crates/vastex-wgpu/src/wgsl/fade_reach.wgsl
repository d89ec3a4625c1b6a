// What is shown at single taps of filters that reach beyond a tile, of tiles that fade in, in the page that covers `offset` texels of level 0 from a position.
// CPU twin: twins/fade.rs.

fn vastexi_shown_beside_KIND(
    texture: VastexiTexture,
    position: VastexiPosition,
    offset: vec2<f32>,
    wanted: u32,
) -> vec4<f32> {
    let beside = vastexi_position_beside(texture, position, offset);
    var place = vastexi_place_POOL(texture, beside, wanted, VASTEXI_SCALE_LAYER);
    var sum = vec4<f32>(0.0);
    var left = 1.0;
    loop {
        let old_share = vastexi_old_share_POOL(place);
        if old_share < 1.0 {
            sum += left * (1.0 - old_share) * vastexi_tap_LAYER(place);
        }
        left *= old_share;
        if left == 0.0 || place.level >= texture.tail_level {
            break;
        }
        place = vastexi_place_POOL(texture, beside, place.level + 1u, VASTEXI_SCALE_LAYER);
    }
    return sum;
}
