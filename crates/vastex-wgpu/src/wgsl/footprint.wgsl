// From gradients to what a pixel covers of level 0: how many levels coarser it is, and along which axis, by filters of which some are
// anisotropic (footprint_round.wgsl where none is). Sampling, feedback and any picture that is compared with theirs use these lines, and those
// of levels.wgsl.
// CPU twin: twins/level.rs.

// What a pixel covers; `dx` and `dy` are texels of level 0 along one pixel.
//
// An anisotropic filter takes it for an ellipse, of which these are two radii that the pixel's axes become: a diagonal one has
// gradients of equal length. Its shorter axis says the level, as long as the longer one is no more than `most_taps` times as long.
fn vastexi_footprint(dx: vec2<f32>, dy: vec2<f32>, most_taps: u32) -> VastexiFootprint {
    let degenerate = vastexi_degenerate_lambda(dx, dy);
    if degenerate != 0.0 {
        return VastexiFootprint(degenerate, vec2<f32>(0.0));
    }
    if most_taps == 1u {
        let rho_squared = clamp(max(dot(dx, dx), dot(dy, dy)), 1e-30, 1e30);
        return VastexiFootprint(0.5 * log2(rho_squared), vec2<f32>(0.0));
    }
    // In units of the largest of them, so that no square is out of range.
    let largest = max(abs(dx), abs(dy));
    let unit = clamp(max(largest.x, largest.y), 1e-15, 1e15);
    let x = clamp(dx / unit, vec2<f32>(-1.0), vec2<f32>(1.0));
    let y = clamp(dy / unit, vec2<f32>(-1.0), vec2<f32>(1.0));
    let squares = x * x + y * y;
    let mixed = x.x * x.y + y.x * y.y;
    let half_difference = 0.5 * (squares.x - squares.y);
    let root = sqrt(half_difference * half_difference + mixed * mixed);
    let longer_squared = max(0.5 * (squares.x + squares.y) + root, 1e-30);
    let area = x.x * y.y - x.y * y.x;
    let shorter_squared = area * area / longer_squared;
    let most = f32(most_taps);
    let rho_squared = max(shorter_squared, longer_squared / (most * most));
    // Where the ellipse is a circle any axis will do.
    var longer = vec2<f32>(half_difference + root + 1e-15, mixed);
    if half_difference < 0.0 {
        longer = vec2<f32>(mixed, root - half_difference + 1e-15);
    }
    let axis = longer / sqrt(dot(longer, longer)) * sqrt(longer_squared) * unit;
    return VastexiFootprint(log2(unit) + 0.5 * log2(rho_squared), axis);
}
