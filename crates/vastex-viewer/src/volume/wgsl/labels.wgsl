// Labels over a volume: whole numbers of things, each in a colour of its own, on slices and along rays. Before this stands volume.wgsl, after
// it the text of Vastex with a member `label`.
//
// Places are in voxels of level 0 of the labels, from an anchor of their own; what the picture is, is said in docs/volumes.md.

struct VolumeLabels {
    scale: vec3<f32>,      // voxels of labels along one of the image
    opacity: f32,
    shift: vec3<f32>,      // a place of labels = one of the image * scale + shift
    id: u32,
    begin: vec3<f32>,      // the box of the labels
    colors: u32,           // entries of the list of colours
    end: vec3<f32>,
    others: f32,           // where one is selected: the share of the opacity that others have, 0 where they are hidden
    anchor: vec3<u32>,     // [voxel of level 0 of the labels]
    outlines: u32,         // 1 where slices show outlines alone
    selected: vec2<u32>,   // the lower 32 bits first; 0 where none is
    hidden: u32,           // labels whose colour is nothing: a list of its own behind that of the colours
    unused: u32,
}

@group(2) @binding(0) var<uniform> volume_labels: VolumeLabels;
// Colours of the file, sorted by labels: lower and upper half, red, green, blue and alpha in a word. Then
// those of the labels whose alpha is 0 once more, sorted alike.
@group(2) @binding(1) var volume_label_list: texture_2d<u32>;

const VOLUME_LABEL_LIST_WIDTH: u32 = 1024u;
// No face: a ray that begins within a label.
const VOLUME_NO_FACE: u32 = 3u;

// Where a ray meets a label.
struct VolumeLabelHit {
    is_hit: bool,
    label: vec2<u32>,
    way: f32,
    lit: f32,              // 0 to 1
}

fn volume_label_mixed(word: u32) -> u32 {
    var mixed = word;
    mixed = (mixed ^ (mixed >> 16u)) * 0x7feb352du;
    mixed = (mixed ^ (mixed >> 15u)) * 0x846ca68bu;
    return mixed ^ (mixed >> 16u);
}

// The colour of a label that the file gives none: a hue, a saturation and a brightness from a hash of all of its bits. The twin is in labels.rs.
fn volume_label_usual(label: vec2<u32>) -> vec4<u32> {
    let hash = volume_label_mixed(volume_label_mixed(label.y ^ 0x9e3779b9u) ^ label.x);
    let hue = ((hash & 0xffffu) * 1536u) >> 16u;
    let saturation = 140u + ((((hash >> 16u) & 0xffu) * 115u) >> 8u);
    let value = 160u + (((hash >> 24u) * 95u) >> 8u);
    let part = hue & 0xffu;
    let low = value * (255u - saturation) / 255u;
    let falling = value * (255u - saturation * part / 255u) / 255u;
    let rising = value * (255u - saturation * (255u - part) / 255u) / 255u;
    var codes = vec3<u32>(value, low, falling);
    switch hue >> 8u {
        case 0u: { codes = vec3<u32>(value, rising, low); }
        case 1u: { codes = vec3<u32>(falling, value, low); }
        case 2u: { codes = vec3<u32>(low, value, rising); }
        case 3u: { codes = vec3<u32>(low, falling, value); }
        case 4u: { codes = vec3<u32>(rising, low, value); }
        default: {}
    }
    return vec4<u32>(codes, 255u);
}

fn volume_label_entry(nth: u32) -> vec4<u32> {
    return textureLoad(volume_label_list, vec2<u32>(nth % VOLUME_LABEL_LIST_WIDTH, nth / VOLUME_LABEL_LIST_WIDTH), 0);
}

fn volume_label_is_less(one: vec2<u32>, other: vec2<u32>) -> bool {
    return one.y < other.y || (one.y == other.y && one.x < other.x);
}

// The colour of a label: sRGB codes, and how opaque it is.
fn volume_label_color(label: vec2<u32>) -> vec4<f32> {
    var first = 0u;
    var end = volume_labels.colors;
    while first < end {
        let middle = (first + end) / 2u;
        let entry = volume_label_entry(middle);
        if all(entry.xy == label) {
            return vec4<f32>((vec4<u32>(entry.z) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(255u)) / 255.0;
        }
        if volume_label_is_less(entry.xy, label) {
            first = middle + 1u;
        } else {
            end = middle;
        }
    }
    return vec4<f32>(volume_label_usual(label)) / 255.0;
}

fn volume_label_has_selection() -> bool {
    return any(volume_labels.selected != vec2<u32>(0u));
}

// Whether a label is drawn by what is selected, or of the selected one alone whether it is that. Its colour
// may still be nothing.
fn volume_label_is_sought(label: vec2<u32>, is_selected: bool) -> bool {
    let is_one_alone = is_selected || (volume_label_has_selection() && volume_labels.others == 0.0);
    return any(label != vec2<u32>(0u)) && (!is_one_alone || all(label == volume_labels.selected));
}

// Whether a label is drawn.
fn volume_label_is_shown(label: vec2<u32>) -> bool {
    return volume_label_is_sought(label, false) && (volume_labels.colors == 0u || volume_label_color(label).a > 0.0);
}

// Light with that of a label over it.
fn volume_label_over(light: vec3<f32>, label: vec2<u32>, lit: f32) -> vec3<f32> {
    let color = volume_label_color(label);
    var opacity = volume_labels.opacity;
    if volume_label_has_selection() {
        opacity = select(opacity * volume_labels.others, 1.0, all(label == volume_labels.selected));
    }
    return mix(light, light_from_display(color.rgb) * lit, color.a * opacity);
}

// The same ray among the labels, within their box and that of the image.
fn volume_label_ray(ray: VolumeRay) -> VolumeRay {
    let origin = ray.origin * volume_labels.scale + volume_labels.shift;
    let direction = ray.direction * volume_labels.scale;
    let still = direction == vec3<f32>(0.0);
    let to_begin = (volume_labels.begin - origin) / direction;
    let to_end = (volume_labels.end - origin) / direction;
    let is_inside = (origin >= volume_labels.begin) & (origin < volume_labels.end);
    let outside = select(vec3<f32>(1e30), vec3<f32>(-1e30), is_inside);
    let near = select(min(to_begin, to_end), outside, still);
    let far = select(max(to_begin, to_end), -outside, still);
    let begin = max(max(max(near.x, near.y), near.z), ray.begin);
    return VolumeRay(origin, direction, begin, min(min(min(far.x, far.y), far.z), ray.end));
}

fn volume_label_level(way: f32) -> f32 {
    return vastex_volume_level_label(volume_labels.id, volume_pixel(way) * volume_labels.scale);
}

// How long a ray is in a voxel of a level, about [world].
fn volume_label_step(ray: VolumeRay, level: f32) -> f32 {
    let voxels = abs(ray.direction) / vastex_volume_scale(volume_labels.id, u32(floor(level)));
    return 1.0 / max(max(voxels.x, voxels.y), voxels.z);
}

// Which axis is the first along which a way ends.
fn volume_label_axis(ways: vec3<f32>) -> u32 {
    return select(select(2u, 1u, ways.y <= ways.z), 0u, ways.x <= ways.y && ways.x <= ways.z);
}

// How a label is lit at a voxel, by the side of it that is seen: which of the 26 voxels around it have the same label says where its boundary
// faces; where that leaves it open, the face through which the ray came.
fn volume_label_lit(ray: VolumeRay, brick: VastexBrick, voxel: vec3<f32>, label: vec2<u32>, face: u32) -> f32 {
    var slope = vec3<f32>(0.0);
    for (var nth = 0u; nth < 27u; nth++) {
        let way = vec3<f32>(vec3<u32>(nth % 3u, (nth / 3u) % 3u, nth / 9u)) - 1.0;
        let weight = 2.0 - abs(way);
        if all(vastex_brick_whole_at_label(brick, voxel + 0.5 + way) == label) {
            slope += way * vec3<f32>(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
        }
    }
    let image_direction = ray.direction / volume_labels.scale;
    let toward = normalize(image_direction * volume_scene.voxel);
    if all(slope == vec3<f32>(0.0)) {
        if face == VOLUME_NO_FACE {
            return 1.0;
        }
        return 0.2 + 0.8 * abs(select(select(toward.z, toward.y, face == 1u), toward.x, face == 0u));
    }
    // Per length of the world.
    let normal = normalize(slope * volume_labels.scale * brick.scale / volume_scene.voxel);
    return 0.2 + 0.8 * abs(dot(normal, toward));
}

// The first voxel of a ray whose label is shown, or that has the selected label: from voxel to voxel of the
// level that is there, each of which is looked at once. Where its label is another hidden one than the last,
// it takes a turn more for each halving of the list of those that are hidden by their colours: of the only one
// in that list, once (LabelColors::turns).
fn volume_label_hit(ray: VolumeRay, is_selected: bool) -> VolumeLabelHit {
    var way = ray.begin;
    var face = VOLUME_NO_FACE;
    if way > 0.0 {
        let sides = select(volume_labels.end, volume_labels.begin, ray.direction > vec3<f32>(0.0));
        let entered = select((sides - ray.origin) / ray.direction, vec3<f32>(-1e30), ray.direction == vec3<f32>(0.0));
        face = volume_label_axis(-entered);
    }
    var voxels = 0u;
    var brick: VastexBrick;
    var voxel = vec3<f32>(0.0);
    var label = vec2<u32>(0u);
    // The last label that was met and is hidden.
    var passed = vec2<u32>(0u);
    // Where among the hidden labels that of the voxel may be; nowhere where it is not looked for.
    var first = 0u;
    var end = 0u;
    var is_hit = false;
    while way < ray.end && voxels < VOLUME_SAMPLES && !is_hit {
        let level = volume_label_level(way);
        // A little within, where rounding does not put it before the brick's beginning.
        let within = min(volume_onward(way, 0.002 * volume_label_step(ray, level)), ray.end);
        brick = vastex_brick_label(volume_labels.id, volume_labels.anchor, volume_at(ray, within), level);
        let exit = min(ray.end, within + vastex_brick_exit(brick, volume_at(ray, within), ray.direction));
        let origin = brick.base + ray.origin * brick.scale;
        let direction = ray.direction * brick.scale;
        voxel = floor(clamp(origin + direction * within, brick.low, brick.high));
        loop {
            // No loop is within this one, nor around it but that of bricks: a software driver takes a turn of
            // it, needed or not.
            if first < end {
                let middle = (first + end) / 2u;
                let entry = volume_label_entry(volume_labels.colors + middle).xy;
                if all(entry == label) {
                    passed = label;
                    end = first;
                } else {
                    let is_behind = volume_label_is_less(entry, label);
                    first = select(first, middle + 1u, is_behind);
                    end = select(middle, end, is_behind);
                    is_hit = first >= end;
                }
            } else {
                label = vastex_brick_whole_at_label(brick, voxel + 0.5);
                if any(label != passed) && volume_label_is_sought(label, is_selected) {
                    first = 0u;
                    end = volume_labels.hidden;
                    is_hit = first >= end;
                }
            }
            if is_hit {
                break;
            }
            if first < end {
                continue;
            }
            voxels++;
            let sides = voxel + select(vec3<f32>(0.0), vec3<f32>(1.0), direction > vec3<f32>(0.0));
            let still = direction == vec3<f32>(0.0);
            let ways = select((sides - origin) / direction, vec3<f32>(1e30), still);
            face = volume_label_axis(ways);
            let next = min(min(ways.x, ways.y), ways.z);
            if !(next < exit) || voxels >= VOLUME_SAMPLES {
                break;
            }
            way = max(way, next);
            voxel += select(vec3<f32>(0.0), sign(direction), vec3<bool>(face == 0u, face == 1u, face == 2u));
        }
        way = select(max(exit, within), way, is_hit);
    }
    if is_hit {
        return VolumeLabelHit(true, label, way, volume_label_lit(ray, brick, voxel, label, face));
    }
    return VolumeLabelHit(false, vec2<u32>(0u), ray.end, 1.0);
}

// The light of a slice with its labels.
fn volume_label_slice(ray: VolumeRay, light: vec3<f32>) -> vec3<f32> {
    let at = ray.origin * volume_labels.scale + volume_labels.shift;
    if !volume_label_is_inside(ray) {
        return light;
    }
    let brick = vastex_brick_label(volume_labels.id, volume_labels.anchor, at, volume_label_level(0.0));
    let label = vastex_brick_whole_label(brick, at);
    if !volume_label_is_shown(label) {
        return light;
    }
    if volume_labels.outlines == 1u {
        // The axes that the plane runs along.
        let runs = (abs(volume_scene.origin_x) + abs(volume_scene.origin_y)) > vec3<f32>(0.0);
        let place = brick.base + at * brick.scale;
        var is_edge = false;
        for (var axis = 0u; axis < 3u; axis++) {
            let one = vec3<f32>(vec3<u32>(u32(axis == 0u), u32(axis == 1u), u32(axis == 2u)));
            if any(runs & (one > vec3<f32>(0.0))) {
                is_edge = is_edge || any(vastex_brick_whole_at_label(brick, place + one) != label);
                is_edge = is_edge || any(vastex_brick_whole_at_label(brick, place - one) != label);
            }
        }
        if !is_edge {
            return light;
        }
    }
    return volume_label_over(light, label, 1.0);
}

// Whether the point of a slice lies among the labels, and in the image.
fn volume_label_is_inside(ray: VolumeRay) -> bool {
    let at = ray.origin * volume_labels.scale + volume_labels.shift;
    return volume_is_inside(ray.origin) && all(at >= volume_labels.begin) && all(at < volume_labels.end);
}

// The light of a pixel with that of labels over it.
fn volume_with_labels(ray: VolumeRay, light: vec3<f32>) -> vec3<f32> {
    if VOLUME_MODE == VOLUME_SLICE {
        return volume_label_slice(ray, light);
    }
    let own = volume_label_ray(ray);
    if !(own.begin < own.end) {
        return light;
    }
    var over = light;
    if volume_label_has_selection() {
        // It shows through all others.
        let selected = volume_label_hit(own, true);
        if selected.is_hit {
            over = volume_label_over(over, selected.label, selected.lit);
        }
        if volume_labels.others == 0.0 {
            return over;
        }
    }
    let first = volume_label_hit(own, false);
    if first.is_hit && !all(first.label == volume_labels.selected) {
        over = volume_label_over(over, first.label, first.lit);
    }
    return over;
}

// What of a ray is of interest among the labels: up to a voxel behind what it shows. That is found from
// voxel to voxel, once for a pixel: a software driver ends one that takes too many turns (ray_bounds.rs).
fn volume_label_met(ray: VolumeRay) -> VolumeRay {
    var own = volume_label_ray(ray);
    if VOLUME_MODE != VOLUME_SLICE && own.begin < own.end {
        let hit = volume_label_hit(own, volume_label_has_selection());
        own.end = min(own.end, hit.way + volume_label_step(own, volume_label_level(hit.way)));
    }
    return own;
}

// Where a ray leaves the brick of labels that it is in, of the level that is wanted there at mip bias 0.
fn volume_label_next(own: VolumeRay, way: f32) -> f32 {
    let level = volume_label_level(way);
    let step = volume_label_step(own, level);
    let within = min(volume_onward(way, 0.01 * step), own.end);
    let box = vastex_volume_box_label(volume_labels.id, volume_labels.anchor, volume_at(own, within), level);
    let exit = within + vastex_box_exit(box, volume_at(own, within), own.direction);
    return min(max(exit, volume_onward(way, 0.02 * step)), own.end);
}

// The bricks of labels that a ray, of which so much is of interest, asks for; of a slice one.
fn volume_label_bricks(ray: VolumeRay, own: VolumeRay) -> u32 {
    if VOLUME_MODE == VOLUME_SLICE {
        return u32(volume_label_is_inside(ray));
    }
    var bricks = 0u;
    var way = own.begin;
    while way < own.end && bricks < VASTEX_RAY_BRICKS {
        way = volume_label_next(own, way);
        bricks++;
    }
    return bricks;
}

// A feedback pixel for the `nth` of them.
fn volume_label_wanted(ray: VolumeRay, own: VolumeRay, nth: u32) -> vec4<u32> {
    if VOLUME_MODE == VOLUME_SLICE {
        let at = ray.origin * volume_labels.scale + volume_labels.shift;
        return vastex_volume_feedback_label(volume_labels.id, volume_labels.anchor, at, volume_label_level(0.0));
    }
    var way = own.begin;
    for (var before = 0u; before < nth; before++) {
        way = volume_label_next(own, way);
    }
    let next = volume_label_next(own, way);
    let at = volume_at(own, 0.5 * (way + next));
    return vastex_volume_feedback_label(volume_labels.id, volume_labels.anchor, at, volume_label_level(way));
}

// A feedback pixel for one of the bricks of labels that a ray meets and that are not there: so many are passed over, if there are more.
fn volume_label_gap(ray: VolumeRay, over: u32) -> vec4<u32> {
    var found = vec4<u32>(0u, 0u, 0u, VASTEX_FEEDBACK_EMPTY);
    if VOLUME_MODE == VOLUME_SLICE {
        let at = ray.origin * volume_labels.scale + volume_labels.shift;
        let level = volume_label_level(0.0);
        if volume_label_is_inside(ray)
            && vastex_brick_lacks(vastex_brick_label(volume_labels.id, volume_labels.anchor, at, level)) {
            found = vastex_volume_feedback_label(volume_labels.id, volume_labels.anchor, at, level);
        }
        return found;
    }
    let own = volume_label_met(ray);
    var left = over;
    var bricks = 0u;
    var way = own.begin;
    while way < own.end && bricks < VASTEX_RAY_BRICKS {
        let next = volume_label_next(own, way);
        let level = volume_label_level(way);
        let at = volume_at(own, 0.5 * (way + next));
        if vastex_brick_lacks(vastex_brick_label(volume_labels.id, volume_labels.anchor, at, level)) {
            found = vastex_volume_feedback_label(volume_labels.id, volume_labels.anchor, at, level);
            if left == 0u {
                break;
            }
            left--;
        }
        way = next;
        bricks++;
    }
    return found;
}
