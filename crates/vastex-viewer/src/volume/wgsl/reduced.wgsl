// What is left of all samples of a ray in volume.wgsl, which stands before this: of each channel the
// largest, the smallest or their mean, in which each counts as much as its part of the ray is long. One
// walk along the ray serves all channels.

// What a channel has before its first sample.
fn volume_of_none() -> f32 {
    return select(select(0.0, 1e38, VOLUME_MODE == VOLUME_MINIP), -1e38, VOLUME_MODE == VOLUME_MIP);
}

// What a channel has with one more value, which counts so much.
fn volume_with(kept: f32, value: f32, weight: f32) -> f32 {
    if VOLUME_MODE == VOLUME_MIP {
        return max(kept, value);
    }
    if VOLUME_MODE == VOLUME_MINIP {
        return min(kept, value);
    }
    return kept + value * weight;
}

fn volume_reduced_light(ray: VolumeRay) -> vec3<f32> {
    var light = vec3<f32>(0.0);
    if !VOLUME_HAS_IMAGE {
        return light;
    }
    let first = volume_scene.of_channel[0].id;
    // What each channel has so far: read and written once for each brick.
    var kept = array<f32, VOLUME_CHANNELS>();
    // In steps of the first level: where a ray has that alone, this is the number of samples.
    var length = 0.0;
    var first_step = 0.0;
    var steps = volume_steps(ray);
    var samples = 0u;
    var count = 0u;
    loop {
        steps = volume_steps_on(steps, ray, first, samples);
        if steps.nth >= steps.end || count >= VOLUME_SAMPLES {
            break;
        }
        first_step = select(first_step, steps.step, count == 0u);
        // A quotient of equals need not be 1 exactly.
        let weight = select(steps.step / first_step, 1.0, steps.step == first_step);
        let lengthened = steps.lengthened / first_step;
        var place = VolumePlace(0u, 0u, min(steps.end - steps.nth, VOLUME_SAMPLES - count));
        // One channel is shown at least; tests before each cost a tenth of a picture by lavapipe.
        loop {
            let piece = volume_piece(steps, ray, place);
            place.samples = piece.samples;
            let longer = select(0.0, lengthened, place.done == 0u);
            var own = select(kept[place.nth], volume_of_none(), count + place.done == 0u);
            // What changes nothing is leapt over, and what is the same everywhere is sampled once.
            let range = vastex_brick_range(piece.brick);
            let is_idle = (VOLUME_MODE == VOLUME_MIP && range.y <= own) || (VOLUME_MODE == VOLUME_MINIP && range.x >= own);
            if range.x == range.y {
                own = volume_with(own, range.x, f32(piece.end - place.done) * weight + longer);
            } else if !is_idle {
                for (var sample = place.done; sample < piece.end; sample++) {
                    let value = volume_sample(piece.brick, volume_at(ray, volume_way(steps, ray, sample)));
                    own = volume_with(own, value, weight + select(0.0, longer, sample == place.done));
                }
            }
            kept[place.nth] = own;
            place = volume_place_after(place, piece.end);
            if !volume_shows(place.nth) {
                break;
            }
        }
        samples = place.samples;
        length += f32(samples) * weight + lengthened;
        count += samples;
    }
    for (var nth = 0u; count > 0u && volume_shows(nth); nth++) {
        let channel = volume_scene.of_channel[nth];
        let value = select(kept[nth], kept[nth] / max(length, 1e-30), VOLUME_MODE == VOLUME_AVERAGE);
        light += light_from_display(volume_color(nth, volume_x(channel, value))) * channel.opacity;
    }
    return light;
}
