// What is shown of tiles that fade in: each is blended with what was shown before it came, which is what the page above shows, itself
// perhaps fading in. How much of that remains stands, for each slot, where the slot lies in the pool.
// CPU twin: twins/fade.rs.

// A tile that has just come is not read, and nothing beside it where it is all there. The tail's never fades, so this ends.
fn vastexi_shown_KIND(texture: VastexiTexture, position: VastexiPosition, taps: VastexiTaps, wanted: u32) -> vec4<f32> {
    var place = vastexi_place_POOL(texture, position, wanted, VASTEXI_SCALE_LAYER);
    var sum = vec4<f32>(0.0);
    var left = 1.0;
    loop {
        let old_share = vastexi_old_share_POOL(place);
        if old_share < 1.0 {
            sum += left * (1.0 - old_share) * vastexi_taken_KIND(texture, position, place, taps, wanted);
        }
        left *= old_share;
        if left == 0.0 || place.level >= texture.tail_level {
            break;
        }
        place = vastexi_place_POOL(texture, position, place.level + 1u, VASTEXI_SCALE_LAYER);
    }
    return sum;
}
