// A hashed page table, which has what is resident of all textures of a pool: three words a bucket (the page's id, low half and high half,
// and its entry). Open addressing with linear probing: at most VASTEXI_HASHED_PROBES buckets from a page's home, no tombstones (CPU twin:
// HashedTable of vastex-core). How many buckets there are follows from where the table ends: the power of two that lies below.

// Where the probe sequence of a page begins, before the number of buckets is taken into account.
fn vastexi_hash_POOL(page: vec2<u32>, seed: u32) -> u32 {
    let low = (page.x ^ seed) * VASTEXI_HASH_LOW;
    let both = ((low ^ (low >> 16u)) ^ page.y) * VASTEXI_HASH_HIGH;
    let mixed = (both ^ (both >> 13u)) * VASTEXI_HASH_LAST;
    return mixed ^ (mixed >> 16u);
}

// The entry of a page, by its whole id, if that is resident, else VASTEXI_NONE: one probe sequence.
fn vastexi_hashed_page_POOL(page: vec2<u32>) -> u32 {
    let doublings = firstLeadingBit(vastexi_table_length_POOL() / 3u);
    let last = (1u << doublings) - 1u;
    var at = vastexi_hash_POOL(page, doublings - VASTEXI_HASHED_FEWEST_BITS);
    for (var probe = 0u; probe < VASTEXI_HASHED_PROBES; probe++) {
        let bucket = 3u * (at & last);
        let high = vastexi_table_word_POOL(bucket + 1u);
        if high == page.y && vastexi_table_word_POOL(bucket) == page.x {
            return vastexi_table_word_POOL(bucket + 2u);
        }
        if high == VASTEXI_NONE {
            break;
        }
        at += 1u;
    }
    return VASTEXI_NONE;
}
