// Compaction of a feedback target: distinct pages, each with its pixel count and its sharpest eighth.
// CPU twin: FeedbackCompactor of vastex-core (wanted/compact.rs).
//
// A bucket of the hash table is claimed by the index of a pixel, plus one, and keys are compared in the raw target. Between frames every
// bucket is free: what is claimed by `count` is freed by `append`.

struct VastexHashBucket {
    owner: atomic<u32>,     // index of the pixel that claimed the bucket, plus 1; 0 where free
    pixels: atomic<u32>,
    sharpness: atomic<u32>, // VASTEX_STEPS_PER_LEVEL less the smallest eighth
}

struct VastexWanted {
    page_low: u32,
    page_high: u32,
    pixels_and_eighth: u32, // the eighth in the low VASTEX_STEP_BITS bits
}

struct VastexList {
    pages: atomic<u32>,
    degenerate: atomic<u32>,
    unused_0: u32,
    unused_1: u32,
    wanted: array<VastexWanted>,
}

@group(0) @binding(0) var raw: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> buckets: array<VastexHashBucket>; // a power of two, twice the pixels at least
@group(0) @binding(2) var<storage, read_write> list: VastexList;

fn pixel_at(index: u32) -> vec4<u32> {
    let width = textureDimensions(raw).x;
    return textureLoad(raw, vec2<u32>(index % width, index / width), 0);
}

fn hash_of(page: vec2<u32>) -> u32 {
    var hash = (page.x ^ (page.y * 0x9e3779b1u)) * 0x85ebca6bu;
    hash = (hash ^ (hash >> 15u)) * 0xc2b2ae35u;
    return hash ^ (hash >> 13u);
}

// The bucket of a page: the one that a pixel with the same page has, or a free one, claimed now.
fn bucket_of(page: vec2<u32>, pixel: u32) -> u32 {
    let mask = arrayLength(&buckets) - 1u;
    var bucket = hash_of(page) & mask;
    loop {
        // Nearly every pixel finds its page there already, so it is looked at before it is claimed.
        var owner = atomicLoad(&buckets[bucket].owner);
        if owner == 0u {
            let claim = atomicCompareExchangeWeak(&buckets[bucket].owner, 0u, pixel + 1u);
            if claim.exchanged {
                break;
            }
            owner = claim.old_value;
        }
        // A weak exchange may also fail on a free bucket; then it is tried again.
        if owner != 0u {
            if all(pixel_at(owner - 1u).xy == page) {
                break;
            }
            bucket = (bucket + 1u) & mask;
        }
    }
    return bucket;
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn count(@builtin(global_invocation_id) invocation: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let size = textureDimensions(raw);
    let index = invocation.y * groups.x * VASTEX_WORKGROUP + invocation.x;
    if index >= size.x * size.y {
        return;
    }
    let pixel = pixel_at(index);
    if pixel.w == VASTEX_FEEDBACK_DEGENERATE {
        atomicAdd(&list.degenerate, 1u);
    }
    if pixel.w == VASTEX_FEEDBACK_WANTED {
        let bucket = bucket_of(pixel.xy, index);
        // Above the eighth stands as how many more pixels it counts.
        atomicAdd(&buckets[bucket].pixels, 1u + (pixel.z >> VASTEX_STEP_BITS));
        atomicMax(&buckets[bucket].sharpness, VASTEX_STEPS_PER_LEVEL - (pixel.z & (VASTEX_STEPS_PER_LEVEL - 1u)));
    }
}

@compute @workgroup_size(VASTEX_WORKGROUP)
fn append(@builtin(global_invocation_id) invocation: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let bucket = invocation.y * groups.x * VASTEX_WORKGROUP + invocation.x;
    if bucket >= arrayLength(&buckets) {
        return;
    }
    let owner = atomicLoad(&buckets[bucket].owner);
    if owner == 0u {
        return;
    }
    let page = pixel_at(owner - 1u).xy;
    let eighth = VASTEX_STEPS_PER_LEVEL - atomicLoad(&buckets[bucket].sharpness);
    let pixels = atomicLoad(&buckets[bucket].pixels);
    // All are free again for the next frame.
    atomicStore(&buckets[bucket].owner, 0u);
    atomicStore(&buckets[bucket].pixels, 0u);
    atomicStore(&buckets[bucket].sharpness, 0u);
    list.wanted[atomicAdd(&list.pages, 1u)] = VastexWanted(page.x, page.y, (pixels << VASTEX_STEP_BITS) | eighth);
}
