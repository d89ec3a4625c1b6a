// Volumes: rays through boxes of voxels, and slices. What is left of a ray after VOLUME_SAMPLES samples, as far as they are counted (steps.wgsl),
// or as many voxels of labels, is not looked at; text.rs says how many these are. After this stand display.wgsl and the text of Vastex for one
// channel, which serves the others too.
//
// Offsets are in voxels of level 0 from the anchor; ways along a ray in lengths of the world. What the modes mean is said in docs/volumes.md;
// an f64 twin of them is in tests/suite/volume_reference.rs.

const VOLUME_MIP: u32 = 0u;
const VOLUME_MINIP: u32 = 1u;
const VOLUME_AVERAGE: u32 = 2u;
const VOLUME_EMISSION: u32 = 3u;
const VOLUME_ISO: u32 = 4u;
const VOLUME_SLICE: u32 = 5u;
// Samples that are blended together, for which each channel is looked up once.
const VOLUME_CHUNK: u32 = 16u;
// What a ray lets through that is taken for nothing: less than a code of 255, so that what rounding has near that is asked for.
const VOLUME_OPAQUE: f32 = 0.003;

override VOLUME_MODE: u32;
// Whether the target stores display values as they are.
override VOLUME_ENCODES: bool;

// Whether voxels are blended in single precision, and not by the device's filter.
override VOLUME_EXACT: bool;

// Whether samples lie anywhere in their parts of a ray, elsewhere for each pixel and each picture: the mean of many such pictures is that of
// samples which are many times as close.
override VOLUME_JITTERS: bool = false;

struct VolumeChannel {
    color: vec3<f32>,      // display values
    opacity: f32,
    low: f32,              // the value of x = 0
    inverse_range: f32,    // x of one unit of values
    gamma: f32,
    id: u32,
    map: u32,              // 1 where a colour map makes its colours
    shown: u32,            // 1, and 0 of those after the last one
}

struct VolumeScene {
    origin: vec3<f32>,     // where the ray of the corner of pixel 0,0 begins [offset]
    pixel: f32,            // smaller side of a pixel there [world]
    origin_x: vec3<f32>,   // from one pixel to the next, to the right
    pixel_growth: f32,     // what that side grows by along a ray [world, per length of the world]
    origin_y: vec3<f32>,   // downward
    step: f32,             // samples are so far apart [sides of a voxel]
    toward: vec3<f32>,     // where that ray goes [world]
    density: f32,          // per length of the world
    toward_x: vec3<f32>,
    iso: f32,              // [value]
    toward_y: vec3<f32>,
    share: f32,            // where samples lie in their parts of a ray where they jitter, the pixel's own share added
    voxel: vec3<f32>,      // sides of a voxel of level 0 [world]
    wants: u32,            // the id that feedback names
    begin: vec3<f32>,      // the box that is shown [offset]
    size_x: f32,           // of the picture [pixels]
    end: vec3<f32>,
    size_y: f32,
    anchor: vec3<u32>,     // [voxel of level 0]
    view: u32,
    plane: vec4<f32>,      // nothing is seen where xyz . offset > w
    of_channel: array<VolumeChannel, 17>, // the last one is never shown
    maps: array<array<vec4<u32>, PALETTE_WORDS>, 16>, // the points of each channel's map
}

@group(1) @binding(0) var<uniform> volume_scene: VolumeScene;

// Where samples lie in their parts of a ray, where they jitter.
var<private> volume_jitter: f32 = 0.5;

struct VolumeCorner {
    @builtin(position) clip: vec4<f32>,
    @location(0) pixel: vec2<f32>,
}

// A ray within the box that is shown.
struct VolumeRay {
    origin: vec3<f32>,     // [offset]
    direction: vec3<f32>,  // a length of the world along it [offset]
    begin: f32,            // [world]
    end: f32,
}

fn volume_corner(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0;
}

fn volume_pixel_at(clip: vec2<f32>) -> vec2<f32> {
    return (clip * vec2<f32>(0.5, -0.5) + 0.5) * vec2<f32>(volume_scene.size_x, volume_scene.size_y);
}

@vertex
fn volume_fill(@builtin(vertex_index) index: u32) -> VolumeCorner {
    let clip = volume_corner(index);
    return VolumeCorner(vec4<f32>(clip, 0.0, 1.0), volume_pixel_at(clip));
}

@vertex
fn volume_fill_wanted(@builtin(vertex_index) index: u32) -> VolumeCorner {
    let clip = volume_corner(index);
    return VolumeCorner(vastex_feedback_clip(volume_scene.view, vec4<f32>(clip, 0.0, 1.0)), volume_pixel_at(clip));
}

fn volume_ray(pixel: vec2<f32>) -> VolumeRay {
    let origin = volume_scene.origin + volume_scene.origin_x * pixel.x + volume_scene.origin_y * pixel.y;
    let toward = volume_scene.toward + volume_scene.toward_x * pixel.x + volume_scene.toward_y * pixel.y;
    let direction = normalize(toward) / volume_scene.voxel;
    // Along an axis on which nothing moves a ray is inside everywhere or nowhere.
    let still = direction == vec3<f32>(0.0);
    let to_begin = (volume_scene.begin - origin) / direction;
    let to_end = (volume_scene.end - origin) / direction;
    let is_inside = (origin >= volume_scene.begin) & (origin < volume_scene.end);
    let outside = select(vec3<f32>(1e30), vec3<f32>(-1e30), is_inside);
    let near = select(min(to_begin, to_end), outside, still);
    let far = select(max(to_begin, to_end), -outside, still);
    let begin = max(max(max(near.x, near.y), near.z), 0.0);
    return volume_clipped(VolumeRay(origin, direction, begin, min(min(far.x, far.y), far.z)));
}

// What is left of a ray before the plane that hides what lies beyond it.
fn volume_clipped(ray: VolumeRay) -> VolumeRay {
    let beyond = dot(volume_scene.plane.xyz, ray.origin) - volume_scene.plane.w;
    let along = dot(volume_scene.plane.xyz, ray.direction);
    if along == 0.0 {
        return VolumeRay(ray.origin, ray.direction, ray.begin, select(ray.end, ray.begin, beyond > 0.0));
    }
    let at = -beyond / along;
    let begin = select(max(ray.begin, at), ray.begin, along > 0.0);
    let end = select(ray.end, min(ray.end, at), along > 0.0);
    return VolumeRay(ray.origin, ray.direction, begin, end);
}

fn volume_at(ray: VolumeRay, way: f32) -> vec3<f32> {
    return ray.origin + ray.direction * way;
}

// A way that is farther by a length, and by a step of single precision at least: far from where a ray begins less than that is lost in
// rounding, and the ray would stand still.
fn volume_onward(way: f32, length: f32) -> f32 {
    return max(way + length, way * 1.00000024);
}

// The sides of a pixel at a way along a ray [voxels of level 0].
fn volume_pixel(way: f32) -> vec3<f32> {
    return vec3<f32>(volume_scene.pixel + volume_scene.pixel_growth * way) / volume_scene.voxel;
}

fn volume_x(channel: VolumeChannel, value: f32) -> f32 {
    let x = clamp((value - channel.low) * channel.inverse_range, 0.0, 1.0);
    // A power of 0 is not told everywhere.
    return select(pow(max(x, 1e-30), channel.gamma), x, channel.gamma == 1.0 || x == 0.0);
}

// Whether there is such a channel. Their number would do, but no condition here may follow from numbers in a
// uniform buffer alone, at places that the text knows: Mesa's lavapipe (22.3) then compiles the shader anew for
// each picture, and keeps all that it has compiled.
fn volume_shows(nth: u32) -> bool {
    return volume_scene.of_channel[nth].shown != 0u;
}

// What is left of all samples of a channel: the largest, the smallest or their mean, in which each counts as much as its part of the ray is
// long; and of how many.
fn volume_reduced(ray: VolumeRay, id: u32) -> vec2<f32> {
    var most = -1e38;
    var least = 1e38;
    var sum = 0.0;
    // In steps of the first level: where a ray has that alone, this is the number of samples.
    var length = 0.0;
    var first_step = 0.0;
    var steps = volume_steps(ray);
    var samples = 0u;
    var count = 0u;
    loop {
        steps = volume_steps_on(steps, ray, id, samples);
        if steps.nth >= steps.end || count >= VOLUME_SAMPLES {
            break;
        }
        first_step = select(first_step, steps.step, count == 0u);
        let middle = volume_at(ray, volume_way(steps, ray, 0u));
        // A quotient of equals need not be 1 exactly.
        let weight = select(steps.step / first_step, 1.0, steps.step == first_step);
        let lengthened = steps.lengthened / first_step;
        let brick = vastex_brick(id, volume_scene.anchor, middle, steps.level);
        samples = min(volume_samples_in(steps, ray, brick), VOLUME_SAMPLES - count);
        // What changes nothing is leapt over, and what is the same everywhere is sampled once.
        let range = vastex_brick_range(brick);
        let is_even = range.x == range.y;
        let is_idle = (VOLUME_MODE == VOLUME_MIP && range.y <= most) || (VOLUME_MODE == VOLUME_MINIP && range.x >= least);
        if is_even {
            most = max(most, range.y);
            least = min(least, range.x);
            sum += range.x * (f32(samples) * weight + lengthened);
        } else if !is_idle {
            for (var sample = 0u; sample < samples; sample++) {
                let value = volume_sample(brick, volume_at(ray, volume_way(steps, ray, sample)));
                most = max(most, value);
                least = min(least, value);
                sum += value * (weight + select(0.0, lengthened, sample == 0u));
            }
        }
        length += f32(samples) * weight + lengthened;
        count += samples;
    }
    if VOLUME_MODE == VOLUME_MIP {
        return vec2<f32>(most, f32(count));
    }
    if VOLUME_MODE == VOLUME_MINIP {
        return vec2<f32>(least, f32(count));
    }
    return vec2<f32>(sum / max(length, 1e-30), f32(count));
}

// The light of channels that are reduced each by itself.
fn volume_reduced_light(ray: VolumeRay) -> vec3<f32> {
    var light = vec3<f32>(0.0);
    for (var nth = 0u; volume_shows(nth); nth++) {
        let channel = volume_scene.of_channel[nth];
        let reduced = volume_reduced(ray, channel.id);
        if reduced.y > 0.0 {
            light += light_from_display(volume_color(nth, volume_x(channel, reduced.x))) * channel.opacity;
        }
    }
    return light;
}

// What a ray gathers where every voxel glows and hides what is behind it: light, and what is let through. `before` says what was.
fn volume_emission(ray: VolumeRay, before: vec4<f32>) -> vec4<f32> {
    var light = before.rgb;
    var through = before.a;
    let first = volume_scene.of_channel[0].id;
    var steps = volume_steps(ray);
    var samples = 0u;
    var count = 0u;
    // Tau and light of the last sample.
    var last = vec4<f32>(0.0);
    loop {
        steps = volume_steps_on(steps, ray, first, samples);
        if steps.nth >= steps.end || count >= VOLUME_SAMPLES || through <= 0.0001 {
            break;
        }
        let middle = volume_at(ray, volume_way(steps, ray, 0u));
        // Of each sample, tau and the light of all channels times theirs.
        var gathered = array<vec4<f32>, VOLUME_CHUNK>();
        var all_samples = min(steps.end - steps.nth, VOLUME_SAMPLES - count);
        samples = VOLUME_CHUNK;
        var shows = false;
        for (var nth = 0u; volume_shows(nth); nth++) {
            let channel = volume_scene.of_channel[nth];
            let brick = vastex_brick(channel.id, volume_scene.anchor, middle, steps.level);
            all_samples = min(all_samples, volume_samples_in(steps, ray, brick));
            samples = min(samples, all_samples);
            // Of what is invisible wherever it is, no sample is taken.
            let range = vastex_brick_range(brick);
            if channel.opacity * max(volume_x(channel, range.x), volume_x(channel, range.y)) <= 0.0 {
                continue;
            }
            shows = true;
            var color = light_from_display(channel.color);
            for (var sample = 0u; sample < samples; sample++) {
                let at = volume_at(ray, volume_way(steps, ray, sample));
                let x = volume_x(channel, volume_sample(brick, at));
                if channel.map != 0u {
                    color = light_from_display(volume_mapped(nth, x));
                }
                let tau = -log(1.0 - min(channel.opacity * x, 0.999)) * volume_scene.density;
                gathered[sample] += vec4<f32>(color * tau, tau);
            }
        }
        if !shows {
            samples = all_samples;
            count += samples;
            last = vec4<f32>(0.0);
            continue;
        }
        for (var sample = 0u; sample < samples; sample++) {
            let lengthened = select(0.0, steps.lengthened, sample == 0u);
            let front = ray.begin + f32(steps.nth + sample) * steps.step - lengthened;
            // The last part ends where the ray does.
            let over = volume_glowing(gathered[sample], min(steps.step + lengthened, ray.end - front), through);
            light += over.rgb;
            through *= over.a;
            last = gathered[sample];
        }
        count += samples;
    }
    // Where what is left has no sample of its own, the last one stands for it.
    let rest = select(0.0, max(ray.end - volume_front(steps, ray), 0.0), steps.nth >= steps.end);
    let over = volume_glowing(last, rest, through);
    return vec4<f32>(light + over.rgb, through * over.a);
}

// The light that a part of a ray adds behind what lets so much through, and what it lets through itself; of its light times tau, and tau.
fn volume_glowing(gathered: vec4<f32>, length: f32, through: f32) -> vec4<f32> {
    let passed = exp(-gathered.a * length);
    let light = through * (1.0 - passed) * gathered.rgb / max(gathered.a, 1e-30);
    return vec4<f32>(light, passed);
}

// What lies at a place of a brick.
fn volume_sample(brick: VastexBrick, offset: vec3<f32>) -> f32 {
    var value = 0.0;
    if VOLUME_EXACT {
        value = vastex_brick_exact(brick, offset).x;
    } else {
        value = vastex_brick_sample(brick, offset).x;
    }
    // What is no number is 0, so that it does not take all of a ray with it.
    return select(value, 0.0, (bitcast<u32>(value) & 0x7fffffffu) > 0x7f800000u);
}

fn volume_value(ray: VolumeRay, id: u32, way: f32) -> f32 {
    let level = vastex_volume_level(id, volume_pixel(way));
    let offset = volume_at(ray, way);
    return volume_sample(vastex_brick(id, volume_scene.anchor, offset, level), offset);
}

// The first way along a ray at which a channel reaches the value of the surface; beyond its end where it never does.
fn volume_crossing(ray: VolumeRay, id: u32) -> f32 {
    var last = ray.begin;
    var last_value = volume_value(ray, id, ray.begin);
    if last_value >= volume_scene.iso {
        return ray.begin;
    }
    var steps = volume_steps(ray);
    var samples = 0u;
    var count = 0u;
    loop {
        steps = volume_steps_on(steps, ray, id, samples);
        if steps.nth >= steps.end || count >= VOLUME_SAMPLES {
            break;
        }
        let middle = volume_at(ray, volume_way(steps, ray, 0u));
        let brick = vastex_brick(id, volume_scene.anchor, middle, steps.level);
        samples = min(volume_samples_in(steps, ray, brick), VOLUME_SAMPLES - count);
        if vastex_brick_range(brick).y < volume_scene.iso {
            // No surface in all of it.
            last = volume_way(steps, ray, samples - 1u);
            last_value = volume_sample(brick, volume_at(ray, last));
        } else {
            for (var sample = 0u; sample < samples; sample++) {
                let way = volume_way(steps, ray, sample);
                let value = volume_sample(brick, volume_at(ray, way));
                if value >= volume_scene.iso {
                    return volume_refined(ray, id, vec2<f32>(last, way), vec2<f32>(last_value, value));
                }
                last = way;
                last_value = value;
            }
        }
        count += samples;
    }
    return 1e30;
}

// Where between two ways, of which the second has reached it, the value of the surface is: by four halvings, then by the secant. The other
// way round the secant would often hit it, and which half is taken then would hang on rounding.
fn volume_refined(ray: VolumeRay, id: u32, ways: vec2<f32>, values: vec2<f32>) -> f32 {
    var before = vec2<f32>(ways.x, values.x);
    var after = vec2<f32>(ways.y, values.y);
    for (var nth = 0u; nth < 4u; nth++) {
        let way = 0.5 * (before.x + after.x);
        let value = volume_value(ray, id, way);
        if value >= volume_scene.iso {
            after = vec2<f32>(way, value);
        } else {
            before = vec2<f32>(way, value);
        }
    }
    let share = (volume_scene.iso - before.y) / max(after.y - before.y, 1e-30);
    return mix(before.x, after.x, clamp(share, 0.0, 1.0));
}

// How steep a channel is, per length of the world, from differences of half a voxel of the level either way.
fn volume_slope(ray: VolumeRay, id: u32, way: f32) -> vec3<f32> {
    let level = vastex_volume_level(id, volume_pixel(way));
    let scale = vastex_volume_scale(id, vastex_volume_whole_level(id, level));
    let at = volume_at(ray, way);
    // What is next to a place is in its own brick, border included: others may not be there where nobody sees them.
    let brick = vastex_brick(id, volume_scene.anchor, at, level);
    var slope = vec3<f32>(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let one = select(vec3<f32>(0.0), scale * 0.5, vec3<bool>(axis == 0u, axis == 1u, axis == 2u));
        let after = volume_sample(brick, at + one);
        let before = volume_sample(brick, at - one);
        slope += select(vec3<f32>(0.0), vec3<f32>(after - before), one > vec3<f32>(0.0));
    }
    return slope / (scale * volume_scene.voxel);
}

fn volume_surface_light(ray: VolumeRay) -> vec3<f32> {
    var nearest = ray.end;
    var light = vec3<f32>(0.0);
    for (var nth = 0u; volume_shows(nth); nth++) {
        let channel = volume_scene.of_channel[nth];
        let way = volume_crossing(ray, channel.id);
        if way < nearest {
            nearest = way;
            let slope = volume_slope(ray, channel.id, way);
            let largest = max(max(abs(slope.x), abs(slope.y)), abs(slope.z));
            let steepness = length(slope / max(largest, 1e-30));
            let toward = normalize(ray.direction * volume_scene.voxel);
            let along = abs(dot(slope / max(largest, 1e-30) / max(steepness, 1e-30), toward));
            let lit = select(1.0, 0.2 + 0.8 * along, largest > 0.0);
            var color = channel.color;
            if channel.map != 0u {
                color = volume_mapped(nth, volume_x(channel, volume_scene.iso));
            }
            light = light_from_display(color) * lit * channel.opacity;
        }
    }
    return light;
}

fn volume_slice_light(ray: VolumeRay) -> vec3<f32> {
    var light = vec3<f32>(0.0);
    for (var nth = 0u; volume_shows(nth); nth++) {
        let channel = volume_scene.of_channel[nth];
        let x = volume_x(channel, volume_value(ray, channel.id, 0.0));
        light += light_from_display(volume_color(nth, x)) * channel.opacity;
    }
    return light;
}

fn volume_is_inside(at: vec3<f32>) -> bool {
    return all(at >= volume_scene.begin) && all(at < volume_scene.end);
}

@fragment
fn volume_picture(@builtin(position) at: vec4<f32>, @location(0) pixel: vec2<f32>) -> @location(0) vec4<f32> {
    let ray = volume_ray(at.xy);
    if VOLUME_JITTERS {
        volume_jitter = fract(volume_noise(at.xy) + volume_scene.share);
    }
    var light = vec3<f32>(0.0);
    if VOLUME_MODE == VOLUME_SLICE {
        if volume_is_inside(ray.origin) {
            light = volume_slice_light(ray);
        }
    } else if ray.begin < ray.end {
        if VOLUME_MODE == VOLUME_EMISSION {
            light = volume_emission(ray, vec4<f32>(0.0, 0.0, 0.0, 1.0)).rgb;
        } else if VOLUME_MODE == VOLUME_ISO {
            light = volume_surface_light(ray);
        } else {
            light = volume_reduced_light(ray);
        }
    }
    light = volume_with_labels(ray, light);
    if VOLUME_ENCODES {
        return vec4<f32>(display_from_light(light), 1.0);
    }
    return vec4<f32>(light, 1.0);
}
