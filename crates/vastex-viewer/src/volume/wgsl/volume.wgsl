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
// Channels that one picture shows at most.
const VOLUME_CHANNELS: u32 = 16u;
// Samples of what glows that are blended together, for which each of several channels is looked up once.
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

// What a ray gathers where every voxel glows and hides what is behind it: light, and what is let through. `before` says what was.
fn volume_emission(ray: VolumeRay, before: vec4<f32>) -> vec4<f32> {
    if !VOLUME_HAS_IMAGE {
        return before;
    }
    var light = before.rgb;
    var through = before.a;
    let first = volume_scene.of_channel[0].id;
    var steps = volume_steps(ray);
    var samples = 0u;
    var count = 0u;
    // Samples that are left in the bricks that were looked up, and the channels that are seen there.
    var left = 0u;
    var seen = 0u;
    // The brick that was looked up last, and of which channel: where one channel alone is seen, its brick up
    // to where the ray leaves it.
    var brick: VastexBrick;
    var whose = VOLUME_CHANNELS;
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
        let is_new = left == 0u;
        if is_new {
            left = min(steps.end - steps.nth, VOLUME_SAMPLES - count);
            seen = 0u;
        }
        samples = min(VOLUME_CHUNK, left);
        var nth = 0u;
        loop {
            if !is_new && ((seen >> nth) & 1u) == 0u {
                continue;
            }
            let channel = volume_scene.of_channel[nth];
            if is_new || whose != nth {
                brick = vastex_brick(channel.id, volume_scene.anchor, middle, steps.level);
                whose = nth;
            }
            if is_new {
                left = min(left, volume_samples_in(steps, ray, 0u, brick));
                samples = min(samples, left);
                // Of what is invisible wherever it is, no sample is taken.
                let range = vastex_brick_range(brick);
                if channel.opacity * max(volume_x(channel, range.x), volume_x(channel, range.y)) <= 0.0 {
                    continue;
                }
                seen |= 1u << nth;
            }
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
            continuing {
                nth++;
                break if !volume_shows(nth);
            }
        }
        if seen == 0u {
            samples = left;
            left = 0u;
            count += samples;
            last = vec4<f32>(0.0);
            continue;
        }
        left -= samples;
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
    return volume_value_of(ray, id, way, vastex_volume_level(id, volume_pixel(way)));
}

fn volume_value_of(ray: VolumeRay, id: u32, way: f32, level: f32) -> f32 {
    let offset = volume_at(ray, way);
    return volume_sample(vastex_brick(id, volume_scene.anchor, offset, level), offset);
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
