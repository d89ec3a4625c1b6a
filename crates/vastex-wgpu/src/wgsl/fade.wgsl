// What is shown of tiles that fade in: each is blended with what was shown before it came, which is what the page above shows, itself
// perhaps fading in. How much of that remains stands, for each slot, where the slot lies in the pool.
// CPU twin: twins/fade.rs.

// How much of what was there before the tile at a place remains: 1 when it has just come, 0 when it is all there.
fn vastex_old_share(place: VastexPlace) -> f32 {
    return f32(textureLoad(vastex_fades, place.cell, place.image, 0).r) / 255.0;
}

// A tile that has just come is not read, and nothing beside it where it is all there. The tail's never fades, so this ends.
fn vastex_shown(position: VastexPosition, taps: VastexTaps, wanted: u32) -> vec4<f32> {
    var place = vastex_place(position, wanted);
    var sum = vec4<f32>(0.0);
    var left = 1.0;
    loop {
        let old_share = vastex_old_share(place);
        if old_share < 1.0 {
            sum += left * (1.0 - old_share) * vastex_taken(position, place, taps, wanted);
        }
        left *= old_share;
        if left == 0.0 || place.level >= vastex_texture.tail_level {
            break;
        }
        place = vastex_place(position, place.level + 1u);
    }
    return sum;
}
