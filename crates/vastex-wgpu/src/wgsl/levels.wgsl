// The level of a texture that is wanted, and the one that is sampled, in which its pool's mip bias counts.
// CPU twin: twins/level.rs.

// The level at mip bias 0.
fn vastexi_unbiased_level(texture: VastexiTexture, lambda: f32) -> f32 {
    return min(max(lambda + texture.bias, texture.finest), texture.coarsest);
}

// The level that is sampled.
fn vastexi_sampled_level(texture: VastexiTexture, lambda: f32, bias: f32) -> f32 {
    return min(vastexi_unbiased_level(texture, lambda) + bias, f32(texture.last_level));
}
