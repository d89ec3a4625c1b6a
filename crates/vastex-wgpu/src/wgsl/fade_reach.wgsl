// The same for single taps of filters that reach beyond a tile, in the page that covers `offset` texels of level 0 from a position.
// CPU twin: twins/fade.rs.

fn vastex_shown_beside(position: VastexPosition, offset: vec2<f32>, wanted: u32) -> vec4<f32> {
    let beside = vastex_position_beside(position, offset);
    var place = vastex_place(beside, wanted);
    var sum = vec4<f32>(0.0);
    var left = 1.0;
    loop {
        let old_share = vastex_old_share(place);
        if old_share < 1.0 {
            sum += left * (1.0 - old_share) * vastex_atlas_linear(place);
        }
        left *= old_share;
        if left == 0.0 || place.level >= vastex_texture.tail_level {
            break;
        }
        place = vastex_place(beside, place.level + 1u);
    }
    return sum;
}
