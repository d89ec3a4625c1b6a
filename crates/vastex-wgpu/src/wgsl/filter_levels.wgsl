// The two levels around the one that is sampled, of filters that take more than one tap of each.
// CPU twin: twins/sample.rs.

fn vastexi_levels_KIND(texture: VastexiTexture, position: VastexiPosition, taps: VastexiTaps, level: f32) -> vec4<f32> {
    let finer = floor(level);
    let share = select(level - finer, 0.0, taps.is_unmixed);
    // A loop, so that what is in it stands once in the program. With a share there is a coarser level.
    let levels = select(2u, 1u, share == 0.0);
    var sum = vec4<f32>(0.0);
    for (var nth = 0u; nth < levels; nth++) {
        let weight = select(1.0 - share, share, nth == 1u);
        sum += weight * vastexi_shown_KIND(texture, position, taps, u32(finer) + nth);
    }
    return sum;
}
