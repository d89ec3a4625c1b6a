// A pool of the text: what its shaders know of it, and where it has a position.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_PARAMS_POOL) var<uniform> vastexi_pool_POOL: VastexiPool;

// Where the finest resident page that covers the position at `wanted`, a level of the texture, has it.
fn vastexi_place_POOL(texture: VastexiTexture, position: VastexiPosition, wanted: u32, scale: u32) -> VastexiPlace {
    // A table has entries of a level that is finer than the tail, or none: then the tail's finest level is looked up.
    let sought = vastexi_sought_POOL(texture, wanted);
    var entry = (sought << VASTEXI_ENTRY_SLOT_BITS) | texture.tail_slot;
    if sought < texture.tail_level {
        entry = vastexi_entry_POOL(texture, position.texel, sought);
    }
    return vastexi_place_of_entry(texture, vastexi_pool_POOL, position, entry, VASTEXI_POWERS_POOL, scale);
}
