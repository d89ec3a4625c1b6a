// A pool of the text that holds bricks of volumes: what its shaders know of it, and where it has a place of a volume.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_PARAMS_POOL) var<uniform> vastexi_pool_POOL: VastexiPool;

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_RANGES_POOL) var vastexi_ranges_POOL: texture_2d<f32>;

// The least and the largest value in the slot of a brick.
fn vastexi_brick_range_POOL(brick: VastexBrick) -> vec2<f32> {
    let at = vec2<u32>(brick.slot % VASTEXI_RANGE_COLUMNS, brick.slot / VASTEXI_RANGE_COLUMNS);
    return textureLoad(vastexi_ranges_POOL, at, 0).xy;
}

// The level that is looked up where `level` is wanted.
fn vastexi_whole_level_POOL(volume: VastexiVolume, level: f32) -> u32 {
    let within = min(max(level, volume.finest), volume.coarsest) + vastexi_pool_POOL.bias;
    return u32(floor(min(within, f32(volume.last_level))));
}

// The brick of a place at `level`, which counts from the finest and is not a whole number; the pool's mip bias is added.
fn vastexi_brick_POOL(id: u32, anchor: vec3<u32>, offset: vec3<f32>, level: f32) -> VastexBrick {
    let volume = vastexi_volume(id);
    if !volume.is_known {
        let nothing = vec3<f32>(0.0);
        let all = vec3<f32>(1e30);
        let first = vec3<u32>(0u);
        return VastexBrick(false, 0u, 0u, first, 0u, VastexBox(-all, all), first, nothing, nothing, nothing, nothing);
    }
    let wanted = vastexi_whole_level_POOL(volume, level);
    let sought = vastexi_sought_POOL(volume, wanted);
    let texel = vastexi_volume_texel(volume, anchor, offset);
    if sought >= volume.tail_level {
        // Where the level itself is not looked up, the finest of the tail is there.
        let shown = max(wanted, volume.tail_level);
        let entry = (shown << VASTEXI_ENTRY_SLOT_BITS) | volume.tail_slot;
        return vastexi_brick_of_entry(volume, vastexi_pool_POOL, anchor, texel, shown, vec3<u32>(0u), entry);
    }
    let shape = vastexi_volume_level(volume, sought);
    let page = vastexi_brick_page(volume, shape, texel);
    let entry = vastexi_brick_entry_POOL(volume, shape, texel, page, sought);
    return vastexi_brick_of_entry(volume, vastexi_pool_POOL, anchor, texel, sought, page, entry);
}
