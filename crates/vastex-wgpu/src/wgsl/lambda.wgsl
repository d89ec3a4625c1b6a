// From gradients to how many levels coarser than level 0 a pixel is. Sampling, feedback and any picture that is compared
// with theirs use these lines, and those of level.wgsl.
// CPU twin: twins/level.rs.

const VASTEX_FINEST: f32 = -1024.0;
const VASTEX_COARSEST: f32 = 1024.0;

// Gradients that say nothing of a level: the lambda that stands for them, or 0 where they are ordinary.
// Tested by their bits, since WGSL has no isnan.
fn vastex_degenerate_lambda(dx: vec2<f32>, dy: vec2<f32>) -> f32 {
    let bits = bitcast<vec4<u32>>(vec4<f32>(dx, dy)) & vec4<u32>(0x7fffffffu);
    if any(bits >= vec4<u32>(0x7f800000u)) {
        return VASTEX_COARSEST;
    }
    if all(bits == vec4<u32>(0u)) {
        return VASTEX_FINEST;
    }
    return 0.0;
}

// How many levels coarser than level 0 a pixel is, negative where it is finer.
// `dx` and `dy` are texels of level 0 along one pixel.
fn vastex_lambda(dx: vec2<f32>, dy: vec2<f32>) -> f32 {
    let degenerate = vastex_degenerate_lambda(dx, dy);
    if degenerate != 0.0 {
        return degenerate;
    }
    let rho_squared = clamp(max(dot(dx, dx), dot(dy, dy)), 1e-30, 1e30);
    return 0.5 * log2(rho_squared);
}
