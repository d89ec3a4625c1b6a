// A surface displaced by heights, for textures and cameras of any size and nearness: everything is told from the camera and from the texel
// below it. Vertices stand on a grid that halves the texture again and again, and are counted in its steps by whole numbers, so that two
// patches that share a vertex have it in the same place, bit by bit. The scene is told by fixed_relief.rs.

struct PatchStart {
    @builtin(vertex_index) index: u32,
    // Of the patch's first corner: steps of the grid from its point before the camera, high parts of both axes, then their low parts of 16
    // bits in one number; and, 8 bits each, the binary logarithm of the steps along a quad, that of how much wider it is near a pole, and
    // whether there are half as many vertices on the upper edge and on the lower one, beyond which patches are wider.
    @location(0) place: vec4<i32>,
}

struct Seen_fixed {
    @builtin(position) clip: vec4<f32>,
    @location(0) offset: vec2<f32>, // texels from the anchor
    @location(1) @interpolate(flat) anchor: vec2<u32>,
}

// A point of the grid.
struct GridPoint {
    high: vec2<i32>, // times 2^16
    low: vec2<i32>,  // 0 to 2^16 - 1
}

// A point of a surface.
struct FixedVertex {
    texels: vec2<f32>,   // from the camera
    turned: vec2<f32>,   // the same the shorter way round the globe
    is_pole: bool,
}

fn grid_shift(corner: PatchStart) -> u32 {
    return u32(corner.place.w) & 0xffu;
}

// High and low part of a coordinate that lies `at` quads of so many steps after another.
fn grid_sum(high: i32, low: i32, at: i32, shift: u32) -> vec2<i32> {
    if shift >= 16u {
        return vec2<i32>(high + (at << (shift - 16u)), low);
    }
    let sum = low + (at << shift);
    return vec2<i32>(high + (sum >> 16u), sum & 0xffff);
}

fn grid_point(corner: PatchStart, at: vec2<i32>) -> GridPoint {
    let shift = grid_shift(corner);
    let wider = (u32(corner.place.w) >> 8u) & 0xffu;
    let x = grid_sum(corner.place.x, corner.place.z & 0xffff, at.x, shift + wider);
    let y = grid_sum(corner.place.y, (corner.place.z >> 16u) & 0xffff, at.y, shift);
    return GridPoint(vec2<i32>(x.x, y.x), vec2<i32>(x.y, y.y));
}

// Whether a vertex is on an edge with half as many.
fn grid_is_halved(corner: PatchStart, row: i32) -> bool {
    let flags = (u32(corner.place.w) >> 16u) & 0x101u;
    return (row == 0 && (flags & 1u) == 1u) || (row == i32(RELIEF_QUADS) && flags >= 0x100u);
}

fn grid_texels(point: GridPoint) -> vec2<f32> {
    return ((vec2<f32>(point.high) * 65536.0) + vec2<f32>(point.low)) * scene.grid[scene_zero].step - scene.grid[scene_zero].rest;
}

fn grid_is_pole(point: GridPoint) -> bool {
    let row = vec2<i32>(point.high.y, point.low.y);
    return RELIEF_GLOBE && (all(row == scene.grid[scene_zero].poles.xy) || all(row == scene.grid[scene_zero].poles.zw));
}

// Turns, in high parts, by which a point is brought to the camera's side of the globe.
fn grid_turn(point: GridPoint) -> i32 {
    let half = scene.grid[scene_zero].turn / 2;
    let is_after = point.high.x > half || (point.high.x == half && point.low.x > 0);
    let is_before = point.high.x < -half || (point.high.x == -half && point.low.x == 0);
    return select(0, select(select(0, scene.grid[scene_zero].turn, is_before), -scene.grid[scene_zero].turn, is_after), RELIEF_GLOBE);
}

fn grid_turned(point: GridPoint, turn: i32) -> GridPoint {
    return GridPoint(point.high + vec2<i32>(turn, 0), point.low);
}

// The sine of an angle up to a few turns, to some 1e-7 of it near 0: what WGSL promises of sin is a thousand times less.
fn fixed_sine(angle: f32) -> f32 {
    let turn = angle - (6.2831853 * round(angle * 0.15915494));
    let far = select(-3.1415927, 3.1415927, turn > 0.0) - turn;
    let x = select(turn, far, abs(turn) > 1.5707963);
    let z = x * x;
    let series = ((((-2.5052108e-8 * z + 2.7557319e-6) * z - 1.9841270e-4) * z + 8.3333333e-3) * z - 0.16666667) * z;
    return x + (x * series);
}

// 1 - cos.
fn fixed_versine(angle: f32) -> f32 {
    let half = fixed_sine(0.5 * angle);
    return 2.0 * half * half;
}

// The cosine of the latitude so far north of the camera's.
fn fixed_cosine(north: f32) -> f32 {
    let camera = scene.fixed[scene_zero].sine_and_cosine;
    return (camera.y * (1.0 - fixed_versine(north))) - (camera.x * fixed_sine(north));
}

// Where the surface without heights is, from the point of it below the camera: east, north and up there.
fn fixed_base(texels: vec2<f32>, is_pole: bool) -> vec3<f32> {
    let east = texels.x / scene.fixed[scene_zero].texels_per_unit.x;
    let north = -texels.y / scene.fixed[scene_zero].texels_per_unit.y;
    if !RELIEF_GLOBE {
        return vec3<f32>(east, north, 0.0);
    }
    let camera = scene.fixed[scene_zero].sine_and_cosine;
    let there = select(fixed_cosine(north), 0.0, is_pole);
    let aside = there * fixed_versine(east);
    return vec3<f32>(there * fixed_sine(east), fixed_sine(north) + (camera.x * aside), -fixed_versine(north) - (camera.y * aside));
}

fn fixed_distance(base: vec3<f32>) -> f32 {
    return length(base - vec3<f32>(0.0, 0.0, scene.fixed[scene_zero].altitude));
}

// A vertex of a patch, on its way to its neighbour in the grid of the next coarser patches; as relief_uv has it.
fn fixed_vertex(corner: PatchStart) -> FixedVertex {
    scene_zero = u32(corner.place.w < 0);
    let at = vec2<i32>(vec2<u32>(corner.index % (RELIEF_QUADS + 1u), corner.index / (RELIEF_QUADS + 1u)));
    let is_halved = grid_is_halved(corner, at.y);
    let fine = grid_point(corner, at - vec2<i32>(select(0, at.x & 1, is_halved), 0));
    let coarse = grid_point(corner, at - (at & vec2<i32>(select(1, 3, is_halved), 1)));
    let turn = grid_turn(fine);
    let fine_turned = grid_texels(grid_turned(fine, turn));
    let quad = exp2(f32(grid_shift(corner)));
    let share = fixed_distance(fixed_base(fine_turned, grid_is_pole(fine))) / (scene.grid[scene_zero].range_per_step * quad);
    let morph = clamp((share - RELIEF_MORPH_BEGIN) / (RELIEF_MORPH_END - RELIEF_MORPH_BEGIN), 0.0, 1.0);
    let is_there = morph == 1.0;
    let texels = grid_texels(fine) + ((grid_texels(coarse) - grid_texels(fine)) * morph);
    let coarse_turned = grid_texels(grid_turned(coarse, turn));
    let turned = fine_turned + ((coarse_turned - fine_turned) * morph);
    let is_pole = select(grid_is_pole(fine), grid_is_pole(coarse), is_there);
    return FixedVertex(select(texels, grid_texels(coarse), is_there), select(turned, coarse_turned, is_there), is_pole);
}

// What is looked at where sampling a texture of an id is to find it: both sides of the date line are one.
fn fixed_place(look: Look, id: u32) -> Look {
    if !RELIEF_GLOBE {
        return look_from_near(look, vastex_size(id));
    }
    let whole = floor(look.offset.x);
    let width = vastex_size(id).x;
    let on = look.anchor.x + u32(max(whole, 0.0));
    let back = u32(max(-whole, 0.0));
    let before = select(look.anchor.x - back, (look.anchor.x + width) - back, back > look.anchor.x);
    let around = select(select(on, on - width, on >= width), before, whole < 0.0);
    let offset = vec2<f32>(look.offset.x - whole, look.offset.y);
    return Look(vec2<u32>(around, look.anchor.y), offset, look.ddx, look.ddy, look.steps, look.is_met);
}

// Texels from the anchor, to be sampled at a level.
fn fixed_at(offset: vec2<f32>) -> Look {
    return Look(scene.fixed[scene_zero].anchor, offset, vec2<f32>(0.0), vec2<f32>(0.0), vec4<f32>(0.0), true);
}

// The value of the surface so many texels from the anchor, at a level; as relief_height has it.
fn fixed_height_at(offset: vec2<f32>, level: f32, is_pole: bool) -> f32 {
    if RELIEF_LEVEL {
        return scene.relief[scene_zero].zero;
    }
    let id = scene.ids.height;
    let place = fixed_place(layer_look(fixed_at(offset), PLACE_HEIGHT), id);
    // Near a pole, where it matters, no difference of large numbers.
    let anchor = scene.fixed[scene_zero].anchor.y;
    let rows = scene.grid[scene_zero].size.y;
    let from_poles = vec2<f32>(f32(anchor) + offset.y, f32(rows - anchor) - offset.y);
    let from_pole = select(max(min(from_poles.x, from_poles.y), 0.0), 0.0, is_pole);
    let share = relief_share(from_pole * (scene.relief[scene_zero].texels.y / f32(rows)), level);
    let size = vastex_size(id);
    let row = select(size.y - 1u, 0u, from_poles.x < from_poles.y);
    let lookups = relief_lookups(share);
    var sums = vec2<f32>(0.0);
    for (var nth = 0u; nth < lookups; nth++) {
        let around = vec2<u32>(u32(max(relief_around(nth), 0.0) * f32(size.x)), row);
        let at = select(around, place.anchor, nth == 0u);
        let beside = select(vec2<f32>(0.0, 0.5), place.offset, nth == 0u);
        let value = relief_surface(vastex_sample_height_fixed_level(id, at, beside, level).r);
        sums = relief_gathered(sums, nth, value);
    }
    return relief_shared(sums, share);
}

fn fixed_height(vertex: FixedVertex, level: f32) -> f32 {
    return fixed_height_at(vertex.turned + scene.fixed[scene_zero].fraction, level, vertex.is_pole);
}

// The ground below the camera, at the level at which it is drawn there: what heights are told from, so that near the camera nothing is
// lost of their differences, and nobody but the shader needs to know it exactly.
fn fixed_ground_below() -> f32 {
    return fixed_height_at(scene.fixed[scene_zero].fraction, relief_level(scene.fixed[scene_zero].altitude), false);
}

fn fixed_point(vertex: FixedVertex) -> vec3<f32> {
    let base = fixed_base(vertex.turned, vertex.is_pole);
    let value = fixed_height(vertex, relief_level(fixed_distance(base)));
    let above = vec3<f32>(0.0, 0.0, ((value - fixed_ground_below()) * scene.relief[scene_zero].scale) - scene.fixed[scene_zero].altitude);
    // The globe widens with height.
    let wider = select(0.0, (value - scene.relief[scene_zero].zero) * scene.relief[scene_zero].scale, RELIEF_GLOBE);
    return base + (base * wider) + above;
}

fn fixed_seen(vertex: FixedVertex, clip: vec4<f32>) -> Seen_fixed {
    return Seen_fixed(clip, vertex.texels + scene.fixed[scene_zero].fraction, scene.fixed[scene_zero].anchor);
}

@vertex
fn place_fixed(corner: PatchStart) -> Seen_fixed {
    let vertex = fixed_vertex(corner);
    return fixed_seen(vertex, scene.clip_from_world * vec4<f32>(fixed_point(vertex), 1.0));
}

@vertex
fn place_fixed_feedback(corner: PatchStart) -> Seen_fixed {
    let vertex = fixed_vertex(corner);
    let clip = scene.clip_from_world * vec4<f32>(fixed_point(vertex), 1.0);
    return fixed_seen(vertex, vastex_feedback_clip(scene.ids.view, clip));
}

fn look_fixed(seen: Seen_fixed) -> Look {
    scene_zero = u32(seen.clip.x < 0.0);
    return Look(seen.anchor, seen.offset, dpdx(seen.offset), dpdy(seen.offset), vec4<f32>(0.0), true);
}

fn fixed_value(look: Look, aside: vec2<f32>) -> f32 {
    let beside = Look(look.anchor, look.offset + aside, look.ddx, look.ddy, look.steps, look.is_met);
    let place = fixed_place(layer_look(beside, PLACE_HEIGHT), scene.ids.height);
    let value = vastex_sample_height_fixed_grad(scene.ids.height, place.anchor, place.offset, place.ddx, place.ddy).r;
    return relief_surface(value);
}

// The slope of the ground, as slope_mesh has it.
fn slope_fixed(look: Look) -> vec3<f32> {
    if RELIEF_LEVEL {
        return vec3<f32>(0.0);
    }
    let texel = vec2<f32>(scene.grid[scene_zero].size) / scene.relief[scene_zero].texels;
    let step = max(texel, abs(look.ddx) + abs(look.ddy));
    var around = vec4<f32>(0.0);
    for (var nth = 0u; nth < 4u; nth++) {
        let value = fixed_value(look, relief_aside(nth, step));
        around = select(around, vec4<f32>(value), vec4<u32>(nth) == vec4<u32>(0u, 1u, 2u, 3u));
    }
    var run = 2.0 * step / scene.fixed[scene_zero].texels_per_unit;
    if RELIEF_GLOBE {
        let northward = (scene.fixed[scene_zero].fraction.y - look.offset.y) / scene.fixed[scene_zero].texels_per_unit.y;
        run.x *= max(fixed_cosine(northward), 0.02);
    }
    return relief_slope(around, run);
}

// How light the ground is.
fn light_fixed(look: Look) -> f32 {
    return relief_light(slope_fixed(look).xy);
}

// As relief_wanted has it.
fn relief_wanted_fixed(look: Look, ddx: vec2<f32>, ddy: vec2<f32>) -> vec4<u32> {
    let away = fixed_distance(fixed_base(look.offset - scene.fixed[scene_zero].fraction, false));
    let spacing = scene.relief[scene_zero].spacing * vec2<f32>(scene.grid[scene_zero].size) * away * vastex_pixel_scale(scene.ids.view);
    let along_x = vec2<f32>(spacing.x, 0.0);
    let along_y = vec2<f32>(0.0, spacing.y);
    let of_vertices = vastexi_footprint(along_x, along_y, VASTEXI_TAPS_ALL).lambda;
    let is_finer = of_vertices < vastexi_footprint(ddx, ddy, VASTEXI_TAPS_ALL).lambda;
    let x = select(ddx, along_x, is_finer);
    let y = select(ddy, along_y, is_finer);
    let wanted = layer_look(Look(look.anchor, look.offset, x, y, look.steps, look.is_met), PLACE_WANTED);
    let place = fixed_place(wanted, scene.ids.all);
    return vastex_feedback_fixed_grad(scene.ids.all, scene.ids.view, place.anchor, place.offset, place.ddx, place.ddy);
}

fn wanted_fixed(seen: Seen_fixed, look: Look) -> vec4<u32> {
    return relief_wanted_fixed(look, look.ddx, look.ddy);
}

@fragment
fn want_fixed(seen: Seen_fixed) -> @location(0) vec4<u32> {
    let along = vastex_gradients(seen.clip, seen.offset);
    return relief_wanted_fixed(look_fixed(seen), along[0], along[1]);
}
