// How far the tiles of a pool have faded in.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_FADES_POOL) var vastexi_fades_POOL: texture_2d_array<u32>;

// How much of what was there before the tile at a place remains: 1 when it has just come, 0 when it is all there.
fn vastexi_old_share_POOL(place: VastexiPlace) -> f32 {
    return f32(textureLoad(vastexi_fades_POOL, vastexi_wholes(place.cell), place.image, 0).r) / 255.0;
}
