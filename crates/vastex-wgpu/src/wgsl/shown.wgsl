// What is shown of tiles that are there at once: what the filter takes of the finest. fade.wgsl stands in its place where tiles fade in and
// values may be mixed.
// CPU twin: twins/fade.rs.

fn vastexi_shown_KIND(texture: VastexiTexture, position: VastexiPosition, taps: VastexiTaps, wanted: u32) -> vec4<f32> {
    let place = vastexi_place_POOL(texture, position, wanted, VASTEXI_SCALE_LAYER);
    return vastexi_taken_KIND(texture, position, place, taps, wanted);
}
