// A pool of the text: what its shaders know of it, and where it has a position.

@group(VASTEXI_GROUP) @binding(VASTEXI_BINDING_PARAMS_POOL) var<uniform> vastexi_pool_POOL: VastexiPool;

// Where the finest resident page that covers the position at `wanted`, a level of the texture, has it.
fn vastexi_place_POOL(texture: VastexiTexture, position: VastexiPosition, wanted: u32, scale: u32) -> VastexiPlace {
    let found = vastexi_found_POOL(texture, position.texel, wanted);
    return vastexi_place_found(texture, vastexi_pool_POOL, position, found, VASTEXI_POWERS_POOL, scale);
}
