// Changes of page tables. Of the direct tables of a pool first new entries, then every eviction, then every load, one invocation for each
// entry at and below a page. An eviction's new entry is the nearest ancestor that stays resident, so no entry is changed by two; a load is an
// atomic minimum, since a finer level is the smaller number: so the order within either half makes no difference. Of the hashed table of a
// pool the buckets that have changed, one invocation each.
//
// A table that has moved to larger memory and what it lay in before take the same batch: what is beyond the smaller one's end is left out.

// Words of a batch: the numbers of fills, evictions and loads, the workgroups ("chunks") of each of these, where changes and levels begin;
// then fills (first entry, count, value, chunks before it), evictions and loads (page x, y, z, the entry that an eviction replaces, the
// entry that comes, the level records' beginning as if there were one for each level, the levels to walk, chunks before it) and level
// records (scale x, y, z, first entry, pages x, y, z). Of a hashed table: how many buckets, three unused, and of each bucket its number
// and its three words.
const FILLS = 0u;
const EVICTIONS = 1u;
const LOADS = 2u;
const FILL_CHUNKS = 3u;
const EVICTION_CHUNKS = 4u;
const LOAD_CHUNKS = 5u;
const CHANGES_AT = 6u;
const LEVELS_AT = 7u;
const HEAD_WORDS = 8u;
const FILL_WORDS = 4u;
const CHANGE_WORDS = 8u;
const LEVEL_WORDS = 7u;
const BUCKET_HEAD_WORDS = 4u;

@group(0) @binding(0) var<storage, read_write> table: array<atomic<u32>>;
@group(0) @binding(1) var<storage, read> batch: array<u32>;

// Where the record lies to which a chunk belongs, of `count` from `first` on: the last whose last word, the chunks before it, is not more.
fn record_of_chunk(first: u32, size: u32, count: u32, chunk: u32) -> u32 {
    var low = 0u;
    var high = count;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if batch[first + middle * size + size - 1u] <= chunk {
            low = middle;
        } else {
            high = middle;
        }
    }
    return first + low * size;
}

fn three_words(at: u32) -> vec3<u32> {
    return vec3<u32>(batch[at], batch[at + 1u], batch[at + 2u]);
}

// The index in the table of the `nth` entry at or below the page of a change, or VASTEX_NONE. A level's entries are counted as a box of as
// many pages as any page of the change's level has below it there; some may lie beyond the texture.
fn entry_below(change: u32, nth: u32) -> u32 {
    let page = three_words(change);
    let levels = batch[change + 5u];
    let walk = batch[change + 6u];
    let levels_at = batch[LEVELS_AT];
    let scale = three_words(levels_at + (levels + (walk >> 16u)) * LEVEL_WORDS);
    var rest = nth;
    for (var below = ((walk >> 8u) & 0xffu) + 1u; below > (walk & 0xffu); below--) {
        let at = levels_at + (levels + below - 1u) * LEVEL_WORDS;
        let pages = three_words(at + 4u);
        let ratio = scale / three_words(at);
        let size = min(ratio, pages);
        let count = size.x * size.y * size.z;
        if rest < count {
            let found = page * ratio + vec3<u32>(rest % size.x, rest / size.x % size.y, rest / (size.x * size.y));
            if any(found >= pages) {
                return VASTEX_NONE;
            }
            return batch[at + 3u] + (found.z * pages.y + found.y) * pages.x + found.x;
        }
        rest -= count;
    }
    return VASTEX_NONE;
}

fn chunk_of(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.y * groups.x + group.x;
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn fill(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = chunk_of(group, groups);
    if chunk >= batch[FILL_CHUNKS] {
        return;
    }
    let record = record_of_chunk(HEAD_WORDS, FILL_WORDS, batch[FILLS], chunk);
    let nth = (chunk - batch[record + 3u]) * VASTEX_WORKGROUP + lane;
    let index = batch[record] + nth;
    if nth < batch[record + 1u] && index < arrayLength(&table) {
        atomicStore(&table[index], batch[record + 2u]);
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn evict(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = chunk_of(group, groups);
    if chunk >= batch[EVICTION_CHUNKS] {
        return;
    }
    let change = record_of_chunk(batch[CHANGES_AT], CHANGE_WORDS, batch[EVICTIONS], chunk);
    let nth = (chunk - batch[change + 7u]) * VASTEX_WORKGROUP + lane;
    let index = entry_below(change, nth);
    if index < arrayLength(&table) && atomicLoad(&table[index]) == batch[change + 3u] {
        atomicStore(&table[index], batch[change + 4u]);
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn load(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let chunk = chunk_of(group, groups);
    if chunk >= batch[LOAD_CHUNKS] {
        return;
    }
    let first = batch[CHANGES_AT] + batch[EVICTIONS] * CHANGE_WORDS;
    let change = record_of_chunk(first, CHANGE_WORDS, batch[LOADS], chunk);
    let nth = (chunk - batch[change + 7u]) * VASTEX_WORKGROUP + lane;
    let index = entry_below(change, nth);
    if index < arrayLength(&table) {
        atomicMin(&table[index], batch[change + 4u]);
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn write(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let nth = chunk_of(group, groups) * VASTEX_WORKGROUP + lane;
    if nth >= batch[0] {
        return;
    }
    let written = BUCKET_HEAD_WORDS + nth * 4u;
    let bucket = 3u * batch[written];
    for (var word = 0u; word < 3u; word++) {
        atomicStore(&table[bucket + word], batch[written + 1u + word]);
    }
}
