// From gradients to what a pixel covers of level 0, where no filter of the text is anisotropic: how many levels coarser it is. What
// footprint.wgsl says of one tap.
// CPU twin: twins/level.rs.

// What a pixel covers; `dx` and `dy` are texels of level 0 along one pixel, and taps are one.
fn vastexi_footprint(dx: vec2<f32>, dy: vec2<f32>, most_taps: u32) -> VastexiFootprint {
    let degenerate = vastexi_degenerate_lambda(dx, dy);
    if degenerate != 0.0 {
        return VastexiFootprint(degenerate, vec2<f32>(0.0));
    }
    let rho_squared = clamp(max(dot(dx, dx), dot(dy, dy)), 1e-30, 1e30);
    return VastexiFootprint(0.5 * log2(rho_squared), vec2<f32>(0.0));
}
