// Page-table changes. Of a direct table first every eviction, then every load, one invocation for each entry at and below a page.
// What makes either half independent of its order is told at the head of vastex-core's table.rs. Of a hashed table the places
// that have changed, one invocation each.

struct VastexChange {
    x: u32,              // the page, in pages of its level
    y: u32,
    z: u32,
    old: u32,            // an eviction: the entry that names the page; a load: unused
    entry: u32,          // what entries are replaced with
    first_chunk: u32,    // chunks of VASTEX_WORKGROUP entries that the changes of its half before it take
}

struct VastexChanges {
    evictions: u32,
    loads: u32,
    eviction_chunks: u32,
    load_chunks: u32,
    changes: array<VastexChange>, // evictions, then loads
}

struct VastexWritten {
    place: u32,
    page_low: u32,
    page_high: u32,
    entry: u32,
}

struct VastexWrittenPlaces {
    count: u32,
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
    written: array<VastexWritten>,
}

@group(0) @binding(0) var<storage, read_write> table: array<atomic<u32>>;
@group(0) @binding(1) var<storage, read> batch: VastexChanges;
@group(0) @binding(1) var<storage, read> places: VastexWrittenPlaces;
@group(0) @binding(2) var<uniform> texture: VastexTexture;

// The change among `count` from `first` on to which a chunk belongs: the last that begins at or before it.
fn change_of_chunk(first: u32, count: u32, chunk: u32) -> u32 {
    var low = 0u;
    var high = count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if batch.changes[first + middle].first_chunk <= chunk {
            low = middle;
        } else {
            high = middle;
        }
    }
    return first + low;
}

// The index in the table of the `nth` entry at or below a page of `level`, or VASTEX_NONE. A level's entries are
// counted as a box of as many pages as any page of `level` has below it there; some may lie beyond the texture.
fn entry_below(change: VastexChange, level: u32, nth: u32) -> u32 {
    var rest = nth;
    for (var below = level + 1u; below > texture.table_level; below--) {
        let at = texture.levels[below - 1u];
        let ratio = texture.levels[level].scale / at.scale;
        let size = min(ratio, at.pages);
        let count = size.x * size.y * size.z;
        if rest < count {
            let page = vec3<u32>(change.x, change.y, change.z) * ratio
                + vec3<u32>(rest % size.x, rest / size.x % size.y, rest / (size.x * size.y));
            if any(page >= at.pages) {
                return VASTEX_NONE;
            }
            return at.first_entry + (page.z * at.pages.y + page.y) * at.pages.x + page.x;
        }
        rest -= count;
    }
    return VASTEX_NONE;
}

fn chunk_of(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.y * groups.x + group.x;
}

// A direct table begins: every entry leads to the tail.
@compute @workgroup_size(VASTEX_WORKGROUP)
fn fill(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = chunk_of(group, groups) * VASTEX_WORKGROUP + lane;
    if index < arrayLength(&table) {
        atomicStore(&table[index], (texture.tail_level << VASTEX_ENTRY_SLOT_BITS) | texture.tail_slot);
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn evict(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = chunk_of(group, groups);
    if chunk >= batch.eviction_chunks {
        return;
    }
    let change = batch.changes[change_of_chunk(0u, batch.evictions, chunk)];
    let nth = (chunk - change.first_chunk) * VASTEX_WORKGROUP + lane;
    let index = entry_below(change, change.old >> VASTEX_ENTRY_SLOT_BITS, nth);
    if index != VASTEX_NONE && atomicLoad(&table[index]) == change.old {
        atomicStore(&table[index], change.entry);
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn load(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = chunk_of(group, groups);
    if chunk >= batch.load_chunks {
        return;
    }
    let change = batch.changes[change_of_chunk(batch.evictions, batch.loads, chunk)];
    let nth = (chunk - change.first_chunk) * VASTEX_WORKGROUP + lane;
    let index = entry_below(change, change.entry >> VASTEX_ENTRY_SLOT_BITS, nth);
    if index != VASTEX_NONE {
        atomicMin(&table[index], change.entry);
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn write(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let nth = chunk_of(group, groups) * VASTEX_WORKGROUP + lane;
    if nth >= places.count {
        return;
    }
    let written = places.written[nth];
    atomicStore(&table[3u * written.place], written.page_low);
    atomicStore(&table[3u * written.place + 1u], written.page_high);
    atomicStore(&table[3u * written.place + 2u], written.entry);
}
