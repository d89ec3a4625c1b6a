// What a pixel covers of level 0, and gradients that say nothing of it; footprint.wgsl or footprint_round.wgsl finds it.
// CPU twin: twins/level.rs.

const VASTEXI_FINEST: f32 = -1024.0;
const VASTEXI_COARSEST: f32 = 1024.0;

// What a pixel covers.
struct VastexiFootprint {
    lambda: f32,     // levels coarser than level 0 at which it is sampled, negative where it is finer
    axis: vec2<f32>, // its longer axis, along which taps lie [texels of level 0]; 0 where the filter takes one
}

// Gradients that say nothing of a level: the lambda that stands for them, or 0 where they are ordinary.
// Tested by their bits, since WGSL has no isnan.
fn vastexi_degenerate_lambda(dx: vec2<f32>, dy: vec2<f32>) -> f32 {
    let bits = bitcast<vec4<u32>>(vec4<f32>(dx, dy)) & vec4<u32>(0x7fffffffu);
    if any(bits >= vec4<u32>(0x7f800000u)) {
        return VASTEXI_COARSEST;
    }
    if all(bits == vec4<u32>(0u)) {
        return VASTEXI_FINEST;
    }
    return 0.0;
}

// Where tap `nth` of `taps` lies, from the middle; from one to the next is a step, the axis over their number.
fn vastexi_tap_offset(step: vec2<f32>, nth: u32, taps: u32) -> vec2<f32> {
    return step * (f32(nth) - 0.5 * f32(taps - 1u));
}

// Taps that a footprint takes at a level: one for each of the level's texels along its axis. A sixteenth is let go, so that whole
// ratios do not hang on rounding.
fn vastexi_tap_count(axis: vec2<f32>, level: f32, most_taps: u32) -> u32 {
    let texels = length(axis) * exp2(-level);
    return u32(clamp(ceil(texels - 0.0625), 1.0, f32(most_taps)));
}
