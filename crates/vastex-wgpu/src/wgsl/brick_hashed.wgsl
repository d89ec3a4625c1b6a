// A lookup in a hashed page table of volumes: one probe sequence for each level up to that of a resident brick.

// The finest level that is looked up where `wanted` is.
fn vastexi_sought_POOL(volume: VastexiVolume, wanted: u32) -> u32 {
    return wanted;
}

// The entry of the finest resident brick that covers `page` of a level finer than the tail.
fn vastexi_brick_entry_POOL(
    volume: VastexiVolume,
    level: VastexiVolumeLevel,
    texel: vec3<u32>,
    page: vec3<u32>,
    number: u32,
) -> u32 {
    for (var coarser = number; coarser < volume.tail_level; coarser++) {
        let at = vastexi_brick_page(volume, vastexi_volume_level(volume, coarser), texel);
        let entry = vastexi_hashed_page_POOL(vastexi_brick_id(volume.number, at, coarser));
        if entry != VASTEXI_NONE {
            return entry;
        }
    }
    return (volume.tail_level << VASTEXI_ENTRY_SLOT_BITS) | volume.tail_slot;
}
