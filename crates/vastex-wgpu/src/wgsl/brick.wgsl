// Bricks: one lookup finds where the voxels of a box lie, for as many samples as fall into it.

// A box of a volume. The first and the last boxes along an axis go on beyond the edge.
struct VastexBox {
    begin: vec3<f32>,     // [offsets from the anchor, in voxels of level 0]
    end: vec3<f32>,
}

// A box of a volume, and where the voxels lie that are shown in it: those of its own brick, or of the finest resident one that covers it.
struct VastexBrick {
    is_known: bool,       // whether the id named a volume
    wanted: u32,          // the level that was looked up, the mip bias included
    shown: u32,           // the level whose voxels are there, that or a coarser one
    page: vec3<u32>,      // the brick that was looked up; 0,0,0 in the tail
    slot: u32,            // where the voxels are
    box: VastexBox,       // for which this holds
    origin: vec3<u32>,    // in the atlas: the slot's first voxel
    scale: vec3<f32>,     // voxels of the shown level along one of level 0
    base: vec3<f32>,      // place in the slot [voxels] = base + offset * scale
    low: vec3<f32>,       // the middles of its first and of its last voxel there, border included
    high: vec3<f32>,
}

// The box of a brick of a level; all of the volume where that is in the tail.
fn vastexi_box(volume: VastexiVolume, anchor: vec3<u32>, number: u32, page: vec3<u32>) -> VastexBox {
    let least = vec3<f32>(-1e30);
    let most = vec3<f32>(1e30);
    if number >= volume.tail_level {
        return VastexBox(least, most);
    }
    let level = vastexi_volume_level(volume, number);
    let side = level.texel_scale * volume.page;
    let first = page * side;
    let begin = vec3<f32>(vec3<i32>(first) - vec3<i32>(anchor));
    let is_last = first + side >= volume.size;
    return VastexBox(select(begin, least, page == vec3<u32>(0u)), select(begin + vec3<f32>(side), most, is_last));
}

// The brick of an entry of the page table that was looked up for `page` of `wanted`, a level finer than the tail, or of any level in the
// tail.
fn vastexi_brick_of_entry(
    volume: VastexiVolume,
    pool: VastexiPool,
    anchor: vec3<u32>,
    texel: vec3<u32>,
    wanted: u32,
    page: vec3<u32>,
    entry: u32,
) -> VastexBrick {
    let shown = entry >> VASTEXI_ENTRY_SLOT_BITS;
    let slot = entry & ((1u << VASTEXI_ENTRY_SLOT_BITS) - 1u);
    let level = vastexi_volume_level(volume, shown);
    let at = vastexi_volume_anchor(level, anchor);
    var voxel = at.voxel;
    var low = vec3<i32>(0);
    var high = vec3<i32>(i32(volume.page + (2u * volume.border)));
    if shown < volume.tail_level {
        voxel -= vastexi_first_voxel(volume, shown, vastexi_brick_page(volume, level, texel));
    } else {
        voxel += level.base;
        low = level.base - i32(volume.border);
        if !volume.is_aligned {
            low = bitcast<vec3<i32>>(vastexi_volume_word(volume, shown, 4u).xyz);
        }
        high = low + vec3<i32>((volume.size - 1u) / level.texel_scale + 1u) + i32(2u * volume.border);
    }
    let base = vec3<f32>(voxel) + at.fraction;
    // As vastexi_cell has it, but in whole numbers. The layer needs no bound: it is a factor of a coordinate in a 3-D texture,
    // which no driver makes of a float once more, as NVIDIA's does the image of an array (see place.wgsl).
    let row = u32((f32(slot) + 0.5) * pool.inverse_slots.x);
    let layer = u32((f32(row) + 0.5) * pool.inverse_slots.y);
    let cell = vec3<u32>(slot - (row * pool.slots.x), row - (layer * pool.slots.y), layer);
    let origin = cell * vec3<u32>(pool.tile, pool.depth);
    let box = vastexi_box(volume, anchor, wanted, page);
    let first = vec3<f32>(low) + 0.5;
    let last = vec3<f32>(high) - 0.5;
    return VastexBrick(true, wanted, shown, page, slot, box, origin, level.inverse_scale, base, first, last);
}

// Where a place lies in the slot of a brick [voxels].
fn vastexi_brick_voxel(brick: VastexBrick, offset: vec3<f32>) -> vec3<f32> {
    return clamp(brick.base + offset * brick.scale, brick.low, brick.high);
}

// How far a ray from `offset` along `direction` goes until it leaves the box of a brick, in lengths of `direction`: at least 0.
fn vastex_brick_exit(brick: VastexBrick, offset: vec3<f32>, direction: vec3<f32>) -> f32 {
    return vastex_box_exit(brick.box, offset, direction);
}

// The same for a box by itself.
fn vastex_box_exit(box: VastexBox, offset: vec3<f32>, direction: vec3<f32>) -> f32 {
    let sides = select(box.begin, box.end, direction > vec3<f32>(0.0));
    let distances = (sides - offset) / direction;
    // Along an axis on which nothing moves there is no way out.
    let reached = select(distances, vec3<f32>(1e30), direction == vec3<f32>(0.0));
    return max(min(min(reached.x, reached.y), reached.z), 0.0);
}

// A ray through a volume. How far along it something lies is counted in lengths of `direction`.
struct VastexRay {
    anchor: vec3<u32>,    // [voxel of level 0]
    origin: vec3<f32>,    // [offset from the anchor, in voxels of level 0]
    direction: vec3<f32>, // [the same]; not 0
    begin: f32,           // the part of it that is looked at
    end: f32,
    pixel: vec3<f32>,     // sides of a pixel of the picture at the origin [voxels of level 0]
    growth: vec3<f32>,    // what they grow by along one length of `direction`; 0 where rays are parallel
}

// How far a ray is through the bricks of a volume: in the part `begin` to `end`, which `brick` has the voxels of.
struct VastexMarch {
    brick: VastexBrick,
    level: f32,           // that a pixel wants there, without the mip bias, as vastex_volume_level gives it
    begin: f32,
    end: f32,
}

// A ray within the box of a volume of so many voxels; where it misses it, its end is no later than its beginning.
fn vastex_ray_within(ray: VastexRay, size: vec3<u32>) -> VastexRay {
    let low = -vec3<f32>(ray.anchor);
    let high = vec3<f32>(vec3<i32>(size) - vec3<i32>(ray.anchor));
    // Along an axis on which nothing moves a ray is inside everywhere or nowhere.
    let still = ray.direction == vec3<f32>(0.0);
    let is_inside = (ray.origin >= low) & (ray.origin < high);
    let outside = select(vec3<f32>(1e30), vec3<f32>(-1e30), is_inside);
    let one = (low - ray.origin) / ray.direction;
    let other = (high - ray.origin) / ray.direction;
    let near = select(min(one, other), outside, still);
    let far = select(max(one, other), -outside, still);
    var within = ray;
    within.begin = max(ray.begin, max(max(near.x, near.y), near.z));
    within.end = min(ray.end, min(min(far.x, far.y), far.z));
    return within;
}

// The place so far along a ray [offset].
fn vastex_ray_at(ray: VastexRay, along: f32) -> vec3<f32> {
    return ray.origin + ray.direction * along;
}

// The sides of a pixel there [voxels of level 0].
fn vastexi_ray_pixel(ray: VastexRay, along: f32) -> vec3<f32> {
    return ray.pixel + ray.growth * along;
}

// How far a ray goes beyond where it is so that rounding does not leave it in the brick before: a hundredth of a voxel, or far along the
// ray as much as a float tells apart there.
fn vastexi_ray_beyond(ray: VastexRay, along: f32) -> f32 {
    let steps = abs(ray.direction);
    return max(0.01 / max(max(steps.x, steps.y), max(steps.z, 1e-30)), abs(along) * exp2(-20.0));
}

// Where a ray that leaves a brick at `exit` goes on: beyond the place where it came into it, so that every march ends.
fn vastexi_ray_onward(ray: VastexRay, along: f32, exit: f32) -> f32 {
    return min(max(exit, along + vastexi_ray_beyond(ray, along)), ray.end);
}

// The pixel of the picture whose ray a fragment of the feedback pass marches [pixels, x to the right, y downward]. `pixel` is the fragment's own
// place, interpolated over the picture; all pixels of the target that answer for one pixel of the picture get the same. Where gaps are looked for
// (vastex_ray_seeks) each gets one of its own; at the right and the lower edge it may lie up to 7 pixels beyond the picture. To be called
// before the ray is made that vastex_march_feedback or vastex_ray_turn is asked about. `position` is @builtin(position) in a feedback pass.
fn vastex_ray_pixel(view: u32, position: vec4<f32>, pixel: vec2<f32>) -> vec2<f32> {
    let answers = vastexi_views[view].answers;
    let block = vastexi_views[view].block;
    let answer = u32(position.y) % answers;
    let above = (f32(answer) + 0.5) / f32(answers) - 0.5;
    let first = vec2<f32>(pixel.x, pixel.y - above * f32(block));
    let gaps = vastexi_views[view].gaps;
    if gaps == 0u {
        return first;
    }
    // Those of one pass are spread over the block, each in a row and a column of its own.
    let nth = (((gaps & 0xffu) - 1u) * answers) + answer;
    let column = nth % block;
    let row = ((5u * (nth / block)) + (3u * column)) % block;
    return first + vec2<f32>(vec2<u32>(column, row));
}

// Whether a view that rests looks for gaps in this frame: each pixel of the target then names one of the bricks that its ray meets and that are
// not there (vastex_brick_lacks), whatever vastex_ray_turn says, or nothing. Never of a view that was not said to rest.
fn vastex_ray_seeks(view: u32) -> bool {
    return vastexi_views[view].gaps != 0u;
}

// How many of the bricks that are not there a ray passes over before it names one, where it meets as many: neighbours name others, and so does
// each ray whenever all pixels are looked at again, so that what can never be had hides nothing. `position` is @builtin(position) in a feedback
// pass.
fn vastex_ray_passes_over(view: u32, position: vec4<f32>) -> u32 {
    let place = vec2<u32>(position.xy);
    return (place.x + (3u * place.y) + vastexi_views[view].frame) % max(vastexi_views[view].gaps >> 8u, 1u);
}

// Whether something coarser is shown in the place of a brick, the mip bias apart.
fn vastex_brick_lacks(brick: VastexBrick) -> bool {
    return brick.is_known && brick.shown > brick.wanted;
}

// Which of `count` bricks that a ray meets it asks for in this frame with this pixel of the target: 0 to `count` - 1, or more where others ask
// for all of them. Neighbours ask for others. Of a view whose rays meet as many bricks as it says, each is asked for from all positions of
// the jitter cycle while the view is seen whole once. `position` is @builtin(position) in a feedback pass.
fn vastex_ray_turn(view: u32, position: vec4<f32>, count: u32) -> u32 {
    let answers = vastexi_views[view].answers;
    let place = vec2<u32>(position.xy) / vastexi_views[view].cell;
    let answer = place.y % answers;
    if answer >= count {
        return count;
    }
    let frame = vastexi_views[view].frame;
    let cell = place.x + (3u * (place.y / answers)) + (frame % VASTEX_JITTER_CYCLE);
    return (cell + (answers * (frame / VASTEX_JITTER_CYCLE)) + answer) % max(count, 1u);
}

// A feedback pixel that counts as much as it matters, for what is loaded first: with 0 as one pixel, as without this call, with 1 as sixteen. What
// matters little is wanted as well.
fn vastex_weighted(wanted: vec4<u32>, weight: f32) -> vec4<u32> {
    let more = u32(clamp(weight, 0.0, 1.0) * f32(VASTEX_MOST_WEIGHT - 1u) + 0.5);
    return vec4<u32>(wanted.xy, wanted.z | (more << VASTEX_STEP_BITS), wanted.w);
}

// Feedback for a place in a volume, at a level as vastex_volume_level gives it.
fn vastexi_brick_feedback(volume: VastexiVolume, anchor: vec3<u32>, offset: vec3<f32>, lambda: f32) -> vec4<u32> {
    if !volume.is_known {
        return vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    }
    let steps = u32(floor(min(max(lambda, volume.finest), volume.coarsest) * f32(VASTEX_STEPS_PER_LEVEL)));
    let number = min(steps / VASTEX_STEPS_PER_LEVEL, volume.tail_level);
    let eighth = min(steps - (number * VASTEX_STEPS_PER_LEVEL), VASTEX_STEPS_PER_LEVEL - 1u);
    var page = vec3<u32>(0u);
    if number < volume.tail_level {
        let level = vastexi_volume_level(volume, number);
        page = vastexi_brick_page(volume, level, vastexi_volume_texel(volume, anchor, offset));
    }
    return vec4<u32>(vastexi_brick_id(volume.number, page, number), eighth, VASTEX_FEEDBACK_WANTED);
}
