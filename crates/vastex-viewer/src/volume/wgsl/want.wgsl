// Which bricks of a volume rays ask for: the feedback of volume.wgsl, which stands before this.

// Where a ray stops to matter: at its end, behind what nothing shines through, or at a surface.
fn volume_end_of_interest(ray: VolumeRay) -> f32 {
    if VOLUME_MODE == VOLUME_ISO {
        return min(ray.end, volume_surface(ray).way);
    }
    return ray.end;
}

// How much what a ray meets matters, by where it lies in the picture: 1 in the middle, 1/4 in its corners.
fn volume_nearness(pixel: vec2<f32>) -> f32 {
    let from_middle = pixel / vec2<f32>(volume_scene.size_x, volume_scene.size_y) * 2.0 - 1.0;
    return 1.0 - 0.375 * dot(from_middle, from_middle);
}

// Each pixel of the target asks for one of the bricks that its ray meets, of the image or of labels, as much as it matters. Of what glows, those that hardly anything
// shines through to are not met.
@fragment
fn volume_want(@builtin(position) position: vec4<f32>, @location(0) pixel: vec2<f32>) -> @location(0) vec4<u32> {
    // Of all pixels that are looked at for gaps some would lie beyond the picture.
    let last = vec2<f32>(volume_scene.size_x, volume_scene.size_y) - 0.5;
    let place = min(vastex_ray_pixel(volume_scene.view, position, pixel), last);
    let ray = volume_ray(place);
    let nothing = vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    let first = volume_scene.of_channel[0].id;
    let nearness = volume_nearness(place);
    if vastex_ray_seeks(volume_scene.view) {
        return volume_gap(ray, vastex_ray_passes_over(volume_scene.view, position), nearness);
    }
    let labelled = volume_label_met(ray);
    let of_labels = volume_label_bricks(ray, labelled);
    if VOLUME_MODE == VOLUME_SLICE {
        if !volume_is_inside(ray.origin) {
            return nothing;
        }
        let of_image = select(0u, 1u, VOLUME_HAS_IMAGE);
        let turn = vastex_ray_turn(volume_scene.view, position, of_image + of_labels);
        if turn >= of_image + of_labels {
            return nothing;
        }
        if turn >= of_image {
            return vastex_weighted(volume_label_wanted(ray, labelled, turn - of_image), nearness);
        }
        let level = vastex_volume_level(first, volume_pixel(0.0));
        return vastex_weighted(
            vastex_volume_feedback(volume_scene.wants, volume_scene.anchor, ray.origin, level), nearness);
    }
    if !(ray.begin < ray.end) {
        return nothing;
    }
    let end = volume_end_of_interest(ray);
    var bricks = 0u;
    var way = ray.begin;
    while way < end && bricks < VASTEX_RAY_BRICKS {
        way = volume_next_brick(ray, first, way, end);
        bricks++;
    }
    // A surface may be where the ray begins.
    bricks = select(0u, max(bricks, 1u), VOLUME_HAS_IMAGE);
    let turn = vastex_ray_turn(volume_scene.view, position, bricks + of_labels);
    if turn >= bricks + of_labels {
        return nothing;
    }
    if turn >= bricks {
        return vastex_weighted(volume_label_wanted(ray, labelled, turn - bricks), nearness);
    }
    way = ray.begin;
    var through = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    for (var nth = 0u; nth < turn && through.a > VOLUME_OPAQUE; nth++) {
        let next = volume_next_brick(ray, first, way, end);
        if VOLUME_MODE == VOLUME_EMISSION {
            through = volume_emission(VolumeRay(ray.origin, ray.direction, way, next), through);
        }
        way = next;
    }
    if through.a <= VOLUME_OPAQUE {
        return nothing;
    }
    let next = volume_next_brick(ray, first, way, end);
    let level = volume_level_asked(ray, first, way);
    return vastex_weighted(
        vastex_volume_feedback(volume_scene.wants, volume_scene.anchor, volume_at(ray, 0.5 * (way + next)), level),
        through.a * nearness);
}

// Whether something coarser is shown in the place of the brick of any channel there, the mip bias apart.
fn volume_lacks(offset: vec3<f32>, level: f32) -> bool {
    for (var nth = 0u; volume_shows(nth); nth++) {
        if vastex_brick_lacks(vastex_brick(volume_scene.of_channel[nth].id, volume_scene.anchor, offset, level)) {
            return true;
        }
    }
    return false;
}

// A feedback pixel for one of the bricks that a ray meets and that are not there: so many are passed over, if there are more.
fn volume_gap(ray: VolumeRay, over: u32, nearness: f32) -> vec4<u32> {
    // Where both are lacking they take turns, and each goes on from one to the next.
    let of_labels = volume_label_gap(ray, over / 2u);
    let is_label = of_labels.w == VASTEX_FEEDBACK_WANTED;
    var of_image = vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    if VOLUME_HAS_IMAGE {
        of_image = volume_image_gap(ray, select(over, over / 2u, is_label), nearness);
    }
    let is_image = of_image.w == VASTEX_FEEDBACK_WANTED;
    if is_label && (!is_image || over % 2u == 1u) {
        return vastex_weighted(of_labels, nearness);
    }
    return of_image;
}

fn volume_image_gap(ray: VolumeRay, over: u32, nearness: f32) -> vec4<u32> {
    var found = vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    let first = volume_scene.of_channel[0].id;
    if VOLUME_MODE == VOLUME_SLICE {
        let level = vastex_volume_level(first, volume_pixel(0.0));
        if volume_is_inside(ray.origin) && volume_lacks(ray.origin, level) {
            found = vastex_weighted(
                vastex_volume_feedback(volume_scene.wants, volume_scene.anchor, ray.origin, level), nearness);
        }
        return found;
    }
    if !(ray.begin < ray.end) {
        return found;
    }
    let end = volume_end_of_interest(ray);
    var through = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    var left = over;
    var bricks = 0u;
    var way = ray.begin;
    // Once at least: a surface may be where the ray begins.
    loop {
        let next = volume_next_brick(ray, first, way, end);
        let level = volume_level_asked(ray, first, way);
        let at = volume_at(ray, 0.5 * (way + next));
        if volume_lacks(at, level) {
            found = vastex_weighted(
                vastex_volume_feedback(volume_scene.wants, volume_scene.anchor, at, level), through.a * nearness);
            if left == 0u {
                break;
            }
            left--;
        }
        if VOLUME_MODE == VOLUME_EMISSION {
            through = volume_emission(VolumeRay(ray.origin, ray.direction, way, next), through);
        }
        way = next;
        bricks++;
        if !(way < end) || bricks >= VASTEX_RAY_BRICKS || through.a <= VOLUME_OPAQUE {
            break;
        }
    }
    return found;
}

// The level that feedback names for the brick that a ray enters at a way: the one that is wanted there, or
// half of a step before, since samples of a finer level go on so far; near the ray's end a whole step, since
// there the coarser level may have no sample any more (steps.wgsl).
fn volume_level_asked(ray: VolumeRay, id: u32, way: f32) -> f32 {
    let level = vastex_volume_level(id, volume_pixel(way));
    let step = volume_step(ray, id, vastex_volume_whole_level(id, level));
    let before = select(0.5, 1.0, way + step > ray.end) * step;
    return vastex_volume_level(id, volume_pixel(max(way - before, ray.begin)));
}

// Where a ray leaves the brick that it is in, of the level that feedback names at mip bias 0. That level is
// chosen where the ray enters a brick, and not sample by sample: what the picture samples within the brick is
// of it, or coarser and so of a brick above it, and bricks above what is named are loaded, too.
fn volume_next_brick(ray: VolumeRay, id: u32, way: f32, end: f32) -> f32 {
    let level = volume_level_asked(ray, id, way);
    // A little within, where rounding does not put it before its beginning.
    let step = volume_step(ray, id, u32(floor(level)));
    let within = min(volume_onward(way, 0.01 * step), end);
    let box = vastex_volume_box(id, volume_scene.anchor, volume_at(ray, within), level);
    let exit = within + vastex_box_exit(box, volume_at(ray, within), ray.direction);
    return min(max(exit, volume_onward(way, 0.02 * step)), end);
}
