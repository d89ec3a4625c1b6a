// The surface of volume.wgsl, which stands before this: where a ray first meets the value of the surface,
// in any channel. One walk along the ray serves all channels, and ends there.

struct VolumeSurface {
    way: f32,       // 1e30 where there is none
    channel: u32,
    level: f32,     // of the sample behind it, as vastex_volume_level gives it
}

// The first place along a ray at which a channel reaches the value of the surface: of the first channel,
// where several are equally near.
fn volume_surface(ray: VolumeRay) -> VolumeSurface {
    var surface = VolumeSurface(1e30, 0u, 0.0);
    if !VOLUME_HAS_IMAGE {
        return surface;
    }
    let first = volume_scene.of_channel[0].id;
    // A surface may be where the ray begins: that is looked at before its samples, as if it were one.
    var before = ray.begin;
    var steps = volume_steps(ray);
    steps.end = 1u;
    steps.level = vastex_volume_level(first, volume_pixel(ray.begin));
    var samples = 0u;
    var count = 0u;
    // The channels that reach it at the last one of the samples.
    var reached = 0u;
    loop {
        var place = VolumePlace(0u, 0u, min(steps.end - steps.nth, VOLUME_SAMPLES - count));
        loop {
            let piece = volume_piece(steps, ray, place);
            place.samples = piece.samples;
            var sample = place.done;
            if vastex_brick_range(piece.brick).y < volume_scene.iso {
                // No surface in all of it.
                sample = piece.end;
            }
            while sample < piece.end
                && !(volume_sample(piece.brick, volume_at(ray, volume_way(steps, ray, sample))) >= volume_scene.iso) {
                sample++;
            }
            if sample < piece.end {
                // What lies behind it is of no interest any more.
                let one = 1u << place.nth;
                reached = select(one, reached | one, sample + 1u == place.samples);
                place.samples = sample + 1u;
            }
            place = volume_place_after(place, piece.end);
            if !volume_shows(place.nth) {
                break;
            }
        }
        samples = place.samples;
        if reached != 0u {
            break;
        }
        before = volume_way(steps, ray, samples - 1u);
        if steps.step == 0.0 {
            // The beginning is none of its samples.
            steps = volume_steps(ray);
            samples = 0u;
        }
        count += samples;
        steps = volume_steps_on(steps, ray, first, samples);
        if steps.nth >= steps.end || count >= VOLUME_SAMPLES {
            break;
        }
    }
    if reached == 0u {
        return surface;
    }
    let after = volume_way(steps, ray, samples - 1u);
    if samples > 1u {
        before = volume_way(steps, ray, samples - 2u);
    }
    for (var nth = 0u; volume_shows(nth); nth++) {
        if ((reached >> nth) & 1u) == 0u {
            continue;
        }
        let way = volume_refined(ray, volume_scene.of_channel[nth].id, steps.level, vec2<f32>(before, after));
        if way < surface.way {
            surface = VolumeSurface(way, nth, steps.level);
        }
    }
    return surface;
}

// Where between two ways, of which the second has reached it, the value of the surface is: by four
// halvings, then by the secant, all of the level by which the second was found to. The other way round the
// secant would often hit it, and which half is taken then would hang on rounding.
fn volume_refined(ray: VolumeRay, id: u32, level: f32, ways: vec2<f32>) -> f32 {
    var before = vec2<f32>(ways.x, volume_value_of(ray, id, ways.x, level));
    var after = vec2<f32>(ways.y, volume_value_of(ray, id, ways.y, level));
    for (var nth = 0u; nth < 4u; nth++) {
        let way = 0.5 * (before.x + after.x);
        let value = volume_value_of(ray, id, way, level);
        if value >= volume_scene.iso {
            after = vec2<f32>(way, value);
        } else {
            before = vec2<f32>(way, value);
        }
    }
    let share = (volume_scene.iso - before.y) / max(after.y - before.y, 1e-30);
    return mix(before.x, after.x, clamp(share, 0.0, 1.0));
}

// How steep a channel is, per length of the world, from differences of half a voxel of the level either
// way.
fn volume_slope(ray: VolumeRay, id: u32, way: f32, level: f32) -> vec3<f32> {
    let scale = vastex_volume_scale(id, vastex_volume_whole_level(id, level));
    let at = volume_at(ray, way);
    // What is next to a place is in its own brick, border included: others may not be there where nobody
    // sees them.
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
    let surface = volume_surface(ray);
    if !(surface.way < ray.end) {
        return vec3<f32>(0.0);
    }
    let channel = volume_scene.of_channel[surface.channel];
    let slope = volume_slope(ray, channel.id, surface.way, surface.level);
    let largest = max(max(abs(slope.x), abs(slope.y)), abs(slope.z));
    let steepness = length(slope / max(largest, 1e-30));
    let toward = normalize(ray.direction * volume_scene.voxel);
    let along = abs(dot(slope / max(largest, 1e-30) / max(steepness, 1e-30), toward));
    let lit = select(1.0, 0.2 + 0.8 * along, largest > 0.0);
    var color = channel.color;
    if channel.map != 0u {
        color = volume_mapped(surface.channel, volume_x(channel, volume_scene.iso));
    }
    return light_from_display(color) * lit * channel.opacity;
}
