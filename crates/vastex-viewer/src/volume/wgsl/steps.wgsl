// Where along a ray of volume.wgsl, which stands before this, samples lie: those of a level at begin + (k
// + 1/2) step. They are counted from where the ray begins, not from where the level changes, so that no
// rounding there moves those that follow. The first sample of a coarser level is the first that does not
// lie before the place where that level is wanted; those of the finer level go on up to that place, and
// beyond it where that sample's own part begins, which is half of its step farther at most. So no sample is
// coarser than wanted, and nothing is left out where levels meet.

// Where in its part of a ray a sample lies: 0 to 1.
fn volume_within() -> f32 {
    return select(0.5, volume_jitter, VOLUME_JITTERS);
}

// What a pixel adds to where samples lie: as good as chance, 0 to 1.
fn volume_noise(pixel: vec2<f32>) -> f32 {
    var word = (u32(pixel.x) * 0x9e3779b1u) + (u32(pixel.y) * 0x85ebca6bu);
    word = (word ^ (word >> 16u)) * 0x7feb352du;
    word = (word ^ (word >> 15u)) * 0x846ca68bu;
    return f32((word ^ (word >> 16u)) >> 8u) / 16777216.0;
}

// How far samples of a level are apart, even where that is longer than the ray [world].
fn volume_step(ray: VolumeRay, id: u32, level: u32) -> f32 {
    let voxels = abs(ray.direction) / vastex_volume_scale(id, level);
    return volume_scene.step / max(max(voxels.x, voxels.y), voxels.z);
}

// The samples of a level, from one of them on.
struct VolumeSteps {
    nth: u32,           // the next one, counted from the ray's beginning
    end: u32,           // the first one that is no longer of this level, or not of the ray
    level: f32,         // as vastex_volume_level gives it for one of them
    step: f32,          // how far they are apart [world]; 0 before all samples
    // By what the next one's part of the ray is longer where the level has just changed; less than 0 where it
    // is shorter [world].
    lengthened: f32,
    next_begin: f32,    // where those of the next level begin
    next_wanted: f32,   // where that level is wanted; 1e30: never
}

// Before the samples of a ray: volume_steps_on leads to the first ones.
fn volume_steps(ray: VolumeRay) -> VolumeSteps {
    return VolumeSteps(0u, 0u, 0.0, 0.0, 0.0, ray.begin, ray.begin);
}

// Where the sample so many after the next one lies.
fn volume_way(steps: VolumeSteps, ray: VolumeRay, after: u32) -> f32 {
    return ray.begin + (f32(steps.nth + after) + volume_within()) * steps.step;
}

// Where the next sample's part of the ray begins, which is where that of the last one ends.
fn volume_front(steps: VolumeSteps, ray: VolumeRay) -> f32 {
    return ray.begin + f32(steps.nth) * steps.step - steps.lengthened;
}

// The first sample that does not lie before a way.
fn volume_first_from(ray: VolumeRay, step: f32, way: f32) -> u32 {
    return u32(clamp(ceil((way - ray.begin) / step - volume_within()), 0.0, 16777216.0));
}

// How many samples of a level lie in a brick, of those from so many after the next one on: the first of
// these is in it.
fn volume_samples_in(steps: VolumeSteps, ray: VolumeRay, after: u32, brick: VastexBrick) -> u32 {
    let nth = steps.nth + after;
    let way = volume_way(steps, ray, after);
    let exit = min(ray.end, way + vastex_brick_exit(brick, volume_at(ray, way), ray.direction));
    return clamp(volume_first_from(ray, steps.step, exit), nth + 1u, steps.end) - nth;
}

// Where a walk along a ray that serves all channels is: samples from its next one on are looked at channel by
// channel, as far as the brick of the first channel goes.
struct VolumePlace {
    nth: u32,       // the channel
    done: u32,      // samples that it has been through
    samples: u32,   // as many are looked at
}

// What a channel has in one brick.
struct VolumePiece {
    brick: VastexBrick,
    end: u32,       // the sample up to which it goes
    samples: u32,   // as many are looked at: where it is the first channel no more than in its brick
}

fn volume_piece(steps: VolumeSteps, ray: VolumeRay, place: VolumePlace) -> VolumePiece {
    let at = volume_at(ray, volume_way(steps, ray, place.done));
    let brick = vastex_brick(volume_scene.of_channel[place.nth].id, volume_scene.anchor, at, steps.level);
    let end = min(place.done + volume_samples_in(steps, ray, place.done, brick), place.samples);
    return VolumePiece(brick, end, select(place.samples, end, place.nth == 0u));
}

// After so many samples of a channel: the next channel, or its own next brick where that ends before the
// first channel's.
fn volume_place_after(place: VolumePlace, end: u32) -> VolumePlace {
    let is_through = end >= place.samples;
    return VolumePlace(place.nth + select(0u, 1u, is_through), select(end, 0u, is_through), place.samples);
}

// The level that is wanted at a way along a ray.
struct VolumeReach {
    level: f32,     // as vastex_volume_level gives it
    whole: u32,
    until: f32,     // where another one is wanted; 1e30: nowhere on the ray
    next: u32,      // which
}

// Pixels grow along a ray, so that levels become coarser, and never finer.
fn volume_reach(ray: VolumeRay, id: u32, begin: f32) -> VolumeReach {
    var reach = VolumeReach(0.0, 0u, 1e30, 0u);
    var low = begin;
    var high = ray.end;
    var way = begin;
    var near = ray.end;
    var is_first = true;
    // Two turns for the ends of the ray, two beside where another level is likely to begin, and as many
    // halvings as bring two numbers beside each other that are not next to nothing.
    for (var turn = 0u; turn < 50u; turn++) {
        let level = vastex_volume_level(id, volume_pixel(way));
        let whole = vastex_volume_whole_level(id, level);
        if is_first {
            reach.level = level;
            reach.whole = whole;
            // The length only so that this hangs on the ray, too (volume_shows).
            if volume_scene.pixel_growth * (ray.end - begin) <= 0.0 {
                break;
            }
            // Where a level begins, the next one does where pixels have grown as much as voxels do: halvings
            // alone would be thrice as many turns, of which a software driver takes few.
            let grown = vastex_volume_scale(id, whole + 1u) / vastex_volume_scale(id, whole);
            let side = volume_scene.pixel + volume_scene.pixel_growth * begin;
            near = begin + (max(max(grown.x, grown.y), grown.z) - 1.0) * side / volume_scene.pixel_growth;
            way = ray.end;
            is_first = false;
            continue;
        }
        if whole != reach.whole {
            high = way;
            reach.until = way;
            reach.next = whole;
        } else if way >= ray.end {
            break;
        } else {
            low = way;
        }
        // As near as numbers lie.
        way = 0.5 * (low + high);
        let beside = near * select(1.000002, 0.999998, turn == 1u);
        way = select(way, beside, turn <= 2u && beside > low && beside < high);
        if !(way > low && way < high) {
            break;
        }
    }
    return reach;
}

// What comes after so many samples: the next ones of their level, else those of the next level that has
// any. At the ray's end none is left, and the front is where the last one's part ends. A ray that has
// none at all, since it is shorter than half of a step, has one in the middle; where samples jitter a ray
// shorter than a step has one anywhere.
fn volume_steps_on(before: VolumeSteps, ray: VolumeRay, id: u32, samples: u32) -> VolumeSteps {
    var steps = before;
    if samples > 0u {
        steps.nth += samples;
        steps.lengthened = 0.0;
    }
    let length = ray.end - ray.begin;
    let is_begin = steps.step == 0.0;
    while steps.nth >= steps.end && steps.next_wanted < ray.end {
        let reach = volume_reach(ray, id, steps.next_wanted);
        let step = volume_step(ray, id, reach.whole);
        var next = ray.end;
        var next_wanted = 1e30;
        if reach.until < ray.end {
            let coarser = volume_step(ray, id, reach.next);
            let wanted = max(reach.until, steps.next_begin);
            let first = f32(volume_first_from(ray, coarser, wanted));
            // Where the coarser level has no sample any more, this one goes on to the ray's end.
            if ray.begin + (first + volume_within()) * coarser < ray.end {
                // Samples that jitter go on no farther beyond than those that do not.
                let side = min(ray.begin + first * coarser, reach.until + 0.5 * coarser);
                next = min(max(wanted, side), ray.end);
                next_wanted = reach.until;
            }
        }
        let nth = volume_first_from(ray, step, steps.next_begin);
        let end = volume_first_from(ray, step, next);
        let is_one = VOLUME_JITTERS && is_begin && step >= length;
        if nth < end && !is_one {
            let lengthened = ray.begin + f32(nth) * step - volume_front(steps, ray);
            steps = VolumeSteps(nth, end, reach.level, step, lengthened, next, next_wanted);
        } else {
            steps.level = reach.level;
            steps.next_begin = next;
            steps.next_wanted = select(next_wanted, 1e30, is_one);
        }
    }
    if is_begin && steps.step == 0.0 {
        return VolumeSteps(0u, select(0u, 1u, length > 0.0), steps.level, length, 0.0, ray.end, 1e30);
    }
    return steps;
}
