// The level of a texture, before its pool's mip bias.
// CPU twin: twins/level.rs.

// The level at mip bias 0.
fn vastex_unbiased_level(lambda: f32) -> f32 {
    return min(max(lambda + vastex_texture.bias, vastex_texture.finest), vastex_texture.coarsest);
}
