// The cubic of Catmull and Rom, which passes through the texels.
// CPU twin: twins/sample.rs.

// Weights of the four texels around a place that lies `at`, 0 to 1, between the middle two.
fn vastexi_cubic_weights(at: f32) -> vec4<f32> {
    return vec4<f32>(
        at * (at * (1.0 - 0.5 * at) - 0.5),
        at * at * (1.5 * at - 2.5) + 1.0,
        at * (at * (2.0 - 1.5 * at) + 0.5),
        at * at * (0.5 * at - 0.5),
    );
}
