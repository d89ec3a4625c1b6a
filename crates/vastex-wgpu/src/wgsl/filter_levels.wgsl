// The two levels around the one that is sampled, of filters that take more than one tap of each.
// CPU twin: twins/sample.rs.

fn vastexi_levels_KIND(texture: VastexiTexture, position: VastexiPosition, taps: VastexiTaps, level: f32) -> vec4<f32> {
    let whole = floor(level);
    let finer = vastexi_whole(whole);
    let sharp = vastexi_shown_KIND(texture, position, taps, finer);
    let share = level - whole;
    if share == 0.0 {
        return sharp;
    }
    // There is a coarser level, since the coarsest is a whole number.
    return mix(sharp, vastexi_shown_KIND(texture, position, taps, finer + 1u), share);
}
