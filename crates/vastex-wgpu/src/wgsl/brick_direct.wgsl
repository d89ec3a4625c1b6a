// A direct page table of volumes, which has an entry for each brick: one read.

// The finest level that is looked up where `wanted` is: that, or a coarser one while the table grows.
fn vastexi_sought_POOL(volume: VastexiVolume, wanted: u32) -> u32 {
    // Commands that were recorded before the tables moved see them as they lay, where the newest levels may be missing.
    let length = vastexi_table_length_POOL();
    let former = select(volume.first_level, volume.former_level, length >= volume.former_end);
    return max(wanted, select(former, volume.table_level, length >= volume.table_end));
}

// The entry of the finest resident brick that covers `page` of a level finer than the tail.
fn vastexi_brick_entry_POOL(
    volume: VastexiVolume,
    level: VastexiVolumeLevel,
    texel: vec3<u32>,
    page: vec3<u32>,
    number: u32,
) -> u32 {
    let row = (page.z * level.pages.y) + page.y;
    return vastexi_table_word_POOL(level.first + (row * level.pages.x) + page.x);
}
