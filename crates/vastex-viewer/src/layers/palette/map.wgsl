// How a colour map is looked up, of which shaders are told the points: evenly spread from 0 to 1, four 8-bit numbers each, and linear from one
// to the next. Before this stand the numbers of points; palette/mod.rs has the twin.

// Where among the points of a colour map a value lies, and the first of the two points around it.
fn palette_place(value: f32) -> f32 {
    return clamp(value, 0.0, 1.0) * f32(PALETTE_LAST);
}

fn palette_first(at: f32) -> u32 {
    return min(u32(at), PALETTE_LAST - 1u);
}

fn palette_between(low: u32, high: u32, share: f32) -> vec3<f32> {
    return mix(unpack4x8unorm(low).rgb, unpack4x8unorm(high).rgb, share);
}
