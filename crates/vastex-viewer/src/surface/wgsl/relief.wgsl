// A surface displaced by heights, in patches that are finer where the camera is nearer: see patches.rs and relief.rs.
// The text after this one is generated: vastex's own for the members `height` and `layer0` and so on of a group, constants, surface.wgsl.
//
// Everything about a vertex follows from its own uv, so that two patches that share it have it in the same place.

// Shares of a patch's range between which its vertices move to the next coarser grid; see patches.rs.
override RELIEF_MORPH_BEGIN: f32;
override RELIEF_MORPH_END: f32;
// Whether the surface is the unit sphere.
override RELIEF_GLOBE: bool;
// Whether what is lower than the value that is not displaced is covered by a sea, which is level.
override RELIEF_SEA: bool;
// Whether there are no heights: any texture stands in their place, and displaces nothing.
override RELIEF_LEVEL: bool;

struct PatchCorner {
    @builtin(vertex_index) index: u32,
    @location(0) origin_and_side: vec4<f32>, // of the patch [uv]
}

struct Seen_mesh {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

const RELIEF_PI: f32 = 3.14159265;
// Towards the sun, from the ground: to the east, to the north, upwards.
const RELIEF_SUN: vec3<f32> = vec3<f32>(-0.5, 0.35, 0.79);
const RELIEF_SHADE: f32 = 0.3;

fn relief_latitude(uv: vec2<f32>) -> f32 {
    return (0.5 - uv.y) * RELIEF_PI;
}

// Upwards, and where uv lies when its height is zero.
fn relief_up(uv: vec2<f32>) -> vec3<f32> {
    if !RELIEF_GLOBE {
        return vec3<f32>(0.0, 0.0, 1.0);
    }
    // Both sides of the date line are one.
    let longitude = (fract(uv.x) - 0.5) * 2.0 * RELIEF_PI;
    let latitude = relief_latitude(uv);
    return vec3<f32>(cos(longitude) * cos(latitude), sin(longitude) * cos(latitude), sin(latitude));
}

fn relief_base(uv: vec2<f32>) -> vec3<f32> {
    if RELIEF_GLOBE {
        return relief_up(uv);
    }
    return vec3<f32>((uv.x - 0.5) * scene.relief[scene_zero].extent.x, (0.5 - uv.y) * scene.relief[scene_zero].extent.y, 0.0);
}

fn relief_distance(uv: vec2<f32>) -> f32 {
    return distance(scene.relief[scene_zero].eye, relief_base(uv));
}

// The level of the heights whose texels are as far apart as the vertices, at a distance.
fn relief_level(at_distance: f32) -> f32 {
    let texels = scene.relief[scene_zero].spacing * scene.relief[scene_zero].texels * at_distance;
    return log2(max(max(texels.x, texels.y), 1e-6));
}

// How much of the height of a place is what the texture says there, so many texels from a pole: all of it, but within half a texel of the level.
// A pole is one point and has one height, the mean of those around it, to which heights go from there. See poles.rs.
fn relief_share(from_pole: f32, level: f32) -> f32 {
    return select(1.0, clamp(from_pole * exp2(1.0 - max(level, 0.0)), 0.0, 1.0), RELIEF_GLOBE);
}

// How often a height is looked up: once, and near a pole at the places around it.
fn relief_lookups(share: f32) -> u32 {
    return select(1u, 1u + RELIEF_AROUND, share < 1.0);
}

// How far round a globe the places around a pole lie, of which the first is looked up second.
fn relief_around(nth: u32) -> f32 {
    return (f32(nth) - 0.5) / f32(RELIEF_AROUND);
}

// The sums of what was looked up: at the place itself, and around a pole.
fn relief_gathered(sums: vec2<f32>, nth: u32, value: f32) -> vec2<f32> {
    return sums + select(vec2<f32>(0.0, value), vec2<f32>(value, 0.0), nth == 0u);
}

fn relief_shared(sums: vec2<f32>, share: f32) -> f32 {
    return select(mix(sums.y / f32(RELIEF_AROUND), sums.x, share), sums.x, share >= 1.0);
}

// The value of the surface at a place, at a level. Both sides of the date line are one.
fn relief_height(uv: vec2<f32>, level: f32) -> f32 {
    let rows = scene.relief[scene_zero].texels.y;
    let share = relief_share(min(uv.y, 1.0 - uv.y) * rows, level);
    let row = select(1.0 - (0.5 / rows), 0.5 / rows, uv.y < 0.5);
    let lookups = relief_lookups(share);
    var sums = vec2<f32>(0.0);
    for (var nth = 0u; nth < lookups; nth++) {
        let here = vec2<f32>(select(uv.x, fract(uv.x), RELIEF_GLOBE), uv.y);
        let at = select(vec2<f32>(relief_around(nth), row), here, nth == 0u);
        let value = relief_surface(vastex_sample_height_level(scene.ids.height, at, level).r);
        sums = relief_gathered(sums, nth, value);
    }
    return relief_shared(sums, share);
}

// The value of the surface where heights have a value.
fn relief_surface(value: f32) -> f32 {
    return select(value, max(value, scene.relief[scene_zero].zero), RELIEF_SEA);
}

fn relief_point(uv: vec2<f32>) -> vec3<f32> {
    if RELIEF_LEVEL {
        return relief_base(uv);
    }
    let value = relief_height(uv, relief_level(relief_distance(uv)));
    return relief_base(uv) + ((value - scene.relief[scene_zero].zero) * scene.relief[scene_zero].scale * relief_up(uv));
}

// A vertex of a patch, on its way to its neighbour in the grid of the next coarser patches.
fn relief_uv(corner: PatchCorner) -> vec2<f32> {
    scene_zero = u32(corner.origin_and_side.z < 0.0);
    let at = vec2<u32>(corner.index % (RELIEF_QUADS + 1u), corner.index / (RELIEF_QUADS + 1u));
    let side = corner.origin_and_side.zw;
    let uv = corner.origin_and_side.xy + side * vec2<f32>(at) / f32(RELIEF_QUADS);
    let coarse = uv - side * vec2<f32>(at & vec2<u32>(1u)) / f32(RELIEF_QUADS);
    let share = relief_distance(uv) / (scene.relief[scene_zero].range_per_side * side.x);
    let morph = clamp((share - RELIEF_MORPH_BEGIN) / (RELIEF_MORPH_END - RELIEF_MORPH_BEGIN), 0.0, 1.0);
    return select(uv + (coarse - uv) * morph, coarse, morph == 1.0);
}

@vertex
fn place_mesh(corner: PatchCorner) -> Seen_mesh {
    let uv = relief_uv(corner);
    return Seen_mesh(scene.clip_from_world * vec4<f32>(relief_point(uv), 1.0), uv);
}

@vertex
fn place_mesh_feedback(corner: PatchCorner) -> Seen_mesh {
    let uv = relief_uv(corner);
    let clip = scene.clip_from_world * vec4<f32>(relief_point(uv), 1.0);
    return Seen_mesh(vastex_feedback_clip(scene.ids.view, clip), uv);
}

fn look_mesh(seen: Seen_mesh) -> Look {
    scene_zero = u32(seen.clip.x < 0.0);
    return Look(vec2<u32>(0u), seen.uv, dpdx(seen.uv), dpdy(seen.uv), vec4<f32>(0.0), true);
}

fn relief_value(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> f32 {
    let at = vec2<f32>(select(uv.x, fract(uv.x), RELIEF_GLOBE), uv.y);
    return relief_surface(vastex_sample_height_grad(scene.ids.height, at, ddx, ddy).r);
}

// How light ground of a slope is that the sun shines on.
fn relief_light(slope: vec2<f32>) -> f32 {
    let normal = normalize(vec3<f32>(-slope, 1.0));
    return mix(max(dot(normal, RELIEF_SUN), 0.0) / RELIEF_SUN.z, 1.0, RELIEF_SHADE);
}

// From a place to one beside it: the first of the four a step to the east, the others to the west, the north and the south.
fn relief_aside(nth: u32, step: vec2<f32>) -> vec2<f32> {
    let along = select(step, -step, (nth & 1u) == 1u);
    return select(vec2<f32>(along.x, 0.0), vec2<f32>(0.0, -along.y), nth >= 2u);
}

// The slope to the east and to the north between values at the four, so far apart in the world, and the value in the middle of them.
fn relief_slope(around: vec4<f32>, run: vec2<f32>) -> vec3<f32> {
    let rise = vec2<f32>(around.x - around.y, around.z - around.w);
    let sum = (around.x + around.y) + (around.z + around.w);
    return vec3<f32>(scene.relief[scene_zero].scale * rise / run, sum * 0.25);
}

// The slope of the ground over a texel or a pixel of heights, to the east and to the north, and the value in the middle of it.
fn slope_mesh(look: Look) -> vec3<f32> {
    if RELIEF_LEVEL {
        return vec3<f32>(0.0);
    }
    let uv = look.offset;
    let step = max(1.0 / scene.relief[scene_zero].texels, abs(look.ddx) + abs(look.ddy));
    // In a loop, since a driver in software does not end with four lookups of several taps after one another (ARCHITECTURE.md, "Where the
    // text bends to a driver").
    var around = vec4<f32>(0.0);
    for (var nth = 0u; nth < 4u; nth++) {
        let value = relief_value(uv + relief_aside(nth, step), look.ddx, look.ddy);
        around = select(around, vec4<f32>(value), vec4<u32>(nth) == vec4<u32>(0u, 1u, 2u, 3u));
    }
    var run = 2.0 * step * scene.relief[scene_zero].extent;
    if RELIEF_GLOBE {
        run.x *= max(cos(relief_latitude(uv)), 0.02);
    }
    return relief_slope(around, run);
}

// How light the ground is.
fn light_mesh(look: Look) -> f32 {
    return relief_light(slope_mesh(look).xy);
}

// What the fragment stage wants of colours and heights, by its gradients, or what the vertex stage wants of the heights, whichever is
// finer: where the ground is seen at a grazing angle, that is the vertices.
fn relief_wanted(uv: vec2<f32>, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<u32> {
    // Gradients are by pixels of the target, levels of vertices by those of the picture.
    let spacing = scene.relief[scene_zero].spacing * relief_distance(uv) * vastex_pixel_scale(scene.ids.view);
    let along_x = vec2<f32>(spacing.x, 0.0);
    let along_y = vec2<f32>(0.0, spacing.y);
    let is_finer = vastex_level_of(scene.ids.all, along_x, along_y) < vastex_level_of(scene.ids.all, ddx, ddy);
    let x = select(ddx, along_x, is_finer);
    return vastex_feedback_grad(scene.ids.all, scene.ids.view, uv, x, select(ddy, along_y, is_finer));
}

fn wanted_mesh(seen: Seen_mesh, look: Look) -> vec4<u32> {
    return relief_wanted(look.offset, look.ddx, look.ddy);
}

// The feedback pass: one entry for colours and heights.
@fragment
fn want_mesh(seen: Seen_mesh) -> @location(0) vec4<u32> {
    scene_zero = u32(seen.clip.x < 0.0);
    let along = vastex_gradients(seen.clip, seen.uv);
    return relief_wanted(seen.uv, along[0], along[1]);
}
