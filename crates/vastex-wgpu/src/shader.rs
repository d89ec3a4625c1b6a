//! Shader text: plain WGSL modules joined by explicit lists, after constants generated from Rust.
//!
//! There is no preprocessor. What varies is a constant, or which of a few small modules with the same
//! functions is in the list (how the atlas is read, how page tables lie). A module that is there once for
//! each pool, layer, way to read one, or name says so in its names: in the place of `POOL`, `LAYER`, `KIND`
//! stands a number, in that of `NAME` the name of a group's member, or nothing.

use std::fmt::Write as _;

use vastex_core::{AddressMode, Dims, shader_constants};

use crate::bind::{BindingPlace, Bindings};
use crate::feedback_mode::FeedbackMode;
use crate::filter::Filter;
use crate::kind::{Atlas, Kinds, PageSides, TableKind, TextPool, TextRead};
use crate::mirror::{
    RECORD_HEAD, RECORD_LEVEL, RECORD_VOLUME_LEVEL, RECORDS as RECORDS_OF_CELL, VIEWS, address_code,
};
use crate::names::{
    self, BRICK, NAMES_BRICK, NAMES_BRICK_BLENDED, NAMES_BRICK_FEEDBACK, NAMES_BRICK_UNBLENDED,
    NAMES_BRICK_VALUES, NAMES_BRICK_WHOLE, NAMES_FEEDBACK, NAMES_SAMPLE, RECORDS, REPORT, TEXTURE_SPACE,
    VIEW, VOLUME_RECORDS,
};
use crate::ranges::RANGE_COLUMNS;

const PARAMS: &str = include_str!("wgsl/params.wgsl");
const PARAM: &str = include_str!("wgsl/param.wgsl");
const LAMBDA: &str = include_str!("wgsl/lambda.wgsl");
const FOOTPRINT: &str = include_str!("wgsl/footprint.wgsl");
const FOOTPRINT_ROUND: &str = include_str!("wgsl/footprint_round.wgsl");
const LEVELS: &str = include_str!("wgsl/levels.wgsl");
const POSITION: &str = include_str!("wgsl/position.wgsl");
const PAGE: &str = include_str!("wgsl/page.wgsl");
const PLACE: &str = include_str!("wgsl/place.wgsl");
const ARENA_BUFFER: &str = include_str!("wgsl/arena_buffer.wgsl");
const ARENA_TEXTURE: &str = include_str!("wgsl/arena_texture.wgsl");
const DIRECT: &str = include_str!("wgsl/direct.wgsl");
const HASHED_POOL: &str = include_str!("wgsl/hashed_pool.wgsl");
const HASHED: &str = include_str!("wgsl/hashed.wgsl");
const POOL: &str = include_str!("wgsl/pool.wgsl");
const ATLAS_FLOAT: &str = include_str!("wgsl/atlas_float.wgsl");
const ATLAS_UNFILTERED: &str = include_str!("wgsl/atlas_unfiltered.wgsl");
const ATLAS_UINT16: &str = include_str!("wgsl/atlas_uint16.wgsl");
const ATLAS_UINT16_RGBA: &str = include_str!("wgsl/atlas_uint16_rgba.wgsl");
const TAPS: &str = include_str!("wgsl/taps.wgsl");
const BRICK_POOL: &str = include_str!("wgsl/brick_pool.wgsl");
const BRICK_DIRECT: &str = include_str!("wgsl/brick_direct.wgsl");
const BRICK_HASHED: &str = include_str!("wgsl/brick_hashed.wgsl");
const ATLAS_FLOAT_3D: &str = include_str!("wgsl/atlas_float_3d.wgsl");
const ATLAS_UNFILTERED_3D: &str = include_str!("wgsl/atlas_unfiltered_3d.wgsl");
const ATLAS_UINT16_3D: &str = include_str!("wgsl/atlas_uint16_3d.wgsl");
const ATLAS_UINT16_RGBA_3D: &str = include_str!("wgsl/atlas_uint16_rgba_3d.wgsl");
const ATLAS_HIGH_LOW_3D: &str = include_str!("wgsl/atlas_high_low_3d.wgsl");
const ATLAS_WHOLE_3D: &str = include_str!("wgsl/atlas_whole_3d.wgsl");
const TAP_3D: &str = include_str!("wgsl/tap_3d.wgsl");
const TAPS_3D: &str = include_str!("wgsl/taps_3d.wgsl");
const REACH: &str = include_str!("wgsl/reach.wgsl");
const CUBIC: &str = include_str!("wgsl/cubic.wgsl");
const SHOWN: &str = include_str!("wgsl/shown.wgsl");
const SHOWN_REACH: &str = include_str!("wgsl/shown_reach.wgsl");
const FADES: &str = include_str!("wgsl/fades.wgsl");
const FADE: &str = include_str!("wgsl/fade.wgsl");
const FADE_REACH: &str = include_str!("wgsl/fade_reach.wgsl");
const FILTER_NEAREST: &str = include_str!("wgsl/filter_nearest.wgsl");
const FILTER_PLAIN: &str = include_str!("wgsl/filter_plain.wgsl");
const FILTER_LEVELS: &str = include_str!("wgsl/filter_levels.wgsl");
const FILTER_ANISOTROPIC: &str = include_str!("wgsl/filter_anisotropic.wgsl");
const FILTER_BICUBIC: &str = include_str!("wgsl/filter_bicubic.wgsl");
const SAMPLE: &str = include_str!("wgsl/sample.wgsl");
const FEEDBACK: &str = include_str!("wgsl/feedback.wgsl");
const INSPECT: &str = include_str!("wgsl/inspect.wgsl");
const REPORTS: &str = include_str!("wgsl/reports.wgsl");
const REPORT_NOTHING: &str = include_str!("wgsl/report_nothing.wgsl");
const INLINE: &str = include_str!("wgsl/inline.wgsl");
const POOL_TABLES: &str = include_str!("wgsl/tables/changes.wgsl");
const COMPACT: &str = include_str!("wgsl/compact.wgsl");

/// Constants that applications may name, which every text has; others stand in a text that names them.
const PUBLIC_CONSTANTS: [&str; 5] =
    ["FEEDBACK_EMPTY", "FEEDBACK_WANTED", "FEEDBACK_DEGENERATE", "STEPS_PER_LEVEL", "FEEDBACK_SCALE"];
/// What begins the names of internal ones that every text has, for what is compared with it.
const COMPARED_CONSTANTS: [&str; 2] = ["ADDRESS_", "FILTER_"];

/// The WGSL that an application puts after its own shader: `MY_SHADER.to_owned() + &wgsl(&kinds, place)`.
///
/// So the application's `enable`, `requires` and `diagnostic` directives, which WGSL has before everything
/// else, stay first, and errors in its text are reported at its own lines; declarations may stand in any
/// order. The text has no directives of its own and begins on a line of its own.
///
/// One text serves every texture of its kinds: `id: u32` says which is meant; it may come from a material or
/// an instance, and need not be uniform. An id that names no texture shows a colour that can be set and wants
/// nothing. `view: u32` is the number of the view that is drawn.
///
/// Public names begin with `vastex_`, `Vastex` or `VASTEX_`; what begins with `vastexi_`, `Vastexi` or
/// `VASTEXI_` may change. To be called, by stage and by what is known there:
///
/// | function | stages | gives |
/// |---|---|---|
/// | `vastex_sample(id, uv)` | fragment, uniform control flow | the texture, `vec4<f32>` |
/// | `vastex_sample_wrapped(id, uv)` | fragment, uniform control flow | the same, where uv jumps from 1 to 0 at a seam |
/// | `vastex_sample_grad(id, uv, ddx, ddy)` | all | the same, from gradients of uv |
/// | `vastex_sample_level(id, uv, level)` | all | the same, at an explicit level |
/// | `vastex_sample_nearest(id, uv)` | fragment, uniform control flow | one texel, whatever the filter |
/// | `vastex_sample_nearest_grad(..)`, `vastex_sample_nearest_level(..)` | all | the same, from gradients of uv, or at a level |
/// | `vastex_feedback(id, view, uv)` | fragment, uniform control flow | a feedback pixel, `vec4<u32>` |
/// | `vastex_feedback_wrapped(id, view, uv)` | fragment, uniform control flow | the same, for `vastex_sample_wrapped` |
/// | `vastex_feedback_grad(id, view, uv, ddx, ddy)` | all | the same, from gradients of uv |
/// | `vastex_feedback_level(id, view, uv, level)` | all | the same, for an explicit level |
/// | `vastex_sample_fixed(id, anchor, offset)` | fragment, uniform control flow | the texture, at a place in fixed point |
/// | `vastex_feedback_fixed(id, view, anchor, offset)` | fragment, uniform control flow | a feedback pixel for it |
/// | either with `_grad(.., ddx, ddy)`, `_level(.., level)` | all | the same, from gradients of the offset, or at a level |
/// | `vastex_report(view, position, wanted)` | fragment, main pass | nothing; reports such a pixel where feedback is inline |
/// | `vastex_asked(view, position)` | fragment, main pass | whether that would report it in this frame |
/// | `vastex_dither(view, position, opacity)` | fragment | for feedback, an alpha test: whether this pixel reports the surface, or what lies behind it |
/// | `vastex_turn(view, position, count)` | fragment | which of `count` answers this pixel gives in this frame |
/// | `vastex_gradients(position, uv)` | fragment, uniform control flow | gradients of uv, exact on flat triangles |
/// | `vastex_feedback_clip(view, clip)` | vertex, feedback pass only | the clip position in the feedback target |
/// | `vastex_pixel_scale(view)` | all | pixels of the picture along one of what is being drawn |
/// | `vastex_size(id)` | all | size of the texture in texels, `vec2<u32>` |
/// | `vastex_level_of(id, ddx, ddy)` | all | the level that a pixel with these gradients of uv wants |
/// | `vastex_texture_space_clip(uv)` | vertex, texture space only | the clip position in texture space |
/// | `vastex_texture_space(id, uv, clip, picture)` | fragment, texture space only | the level that a picture needs, `vec4<f32>` |
/// | `vastex_texture_space_front(id, uv, clip, picture)` | the same | the same, where the texture is not mirrored |
/// | `vastex_inspect(id, uv)` | fragment, uniform control flow | levels wanted and shown, page and place, `VastexInspection` |
/// | `vastex_inspect_grad(id, uv, ddx, ddy)` | all | the same, from gradients of uv |
/// | `vastex_inspect_fixed_grad(id, anchor, offset, ddx, ddy)` | all | the same, at a place in fixed point |
/// | `vastex_inspect_page(id, page, level)` | all | the level of the finest resident page that covers a page, `u32` |
/// | `vastex_inspect_slot(slot, tile_texel)` | all | a texel of a slot of the pool, `vec4<f32>` |
/// | `vastex_inspect_slot_size()` | all | the size of a slot in texels of the texture, border included, `vec2<u32>` |
///
/// A text for volumes has these in the place of those that sample, tell and ask by uv:
///
/// | function | where | gives |
/// |---|---|---|
/// | `vastex_volume_level(id, pixel)` | all | the level that a pixel wants, from its size in voxels of level 0 along each axis |
/// | `vastex_brick(id, anchor, offset, level)` | all | where the voxels of a box lie, `VastexBrick` |
/// | `vastex_volume_whole_level(id, level)` | all | the level that is looked up there, the mip bias included, `u32` |
/// | `vastex_volume_scale(id, level)` | all | voxels of level 0 along one of a level, `vec3<f32>` |
/// | `vastex_volume_box(id, anchor, offset, level)` | all | the box of the brick that feedback names, `VastexBox` |
/// | `vastex_brick_range(brick)` | all | the least and the largest value that is shown there, `vec2<f32>` |
/// | `vastex_brick_exit(brick, offset, direction)` | all | how far a ray goes until it leaves the box of a brick |
/// | `vastex_box_exit(box, offset, direction)` | all | the same for a box |
/// | `vastex_ray_within(ray, size)` | all | a `VastexRay` within the box of a volume |
/// | `vastex_ray_at(ray, along)` | all | the place so far along a ray, in lengths of its direction |
/// | `vastex_march(ray)`, `vastex_march_next(&march, id, ray)` | all | a `VastexMarch` through the bricks of a ray, one after another |
/// | `vastex_march_feedback(id, view, position, ray)` | fragment, feedback pass | a feedback pixel for a ray |
/// | `vastex_ray_pixel(view, position, pixel)` | fragment, feedback pass | the place in the picture of a ray, from that of its fragment |
/// | `vastex_ray_turn(view, position, count)` | fragment, feedback pass | which of `count` bricks a ray asks for in this frame |
/// | `vastex_weighted(wanted, weight)` | all | such a feedback pixel that counts as much as it matters, 0 to 1 |
/// | `vastex_brick_sample(brick, offset)` | all | what lies at a place in it, blended from eight voxels, or by the nearest filter one voxel |
/// | `vastex_brick_exact(brick, offset)` | all | the same blended by the shader in single precision |
/// | `vastex_brick_nearest(brick, offset)` | all | the voxel there |
/// | `vastex_volume_sample(id, anchor, offset, level)` | all | both for one sample, `vec4<f32>` |
/// | `vastex_brick_whole(brick, offset)` | all, of labels | the whole number of the voxel there, its lower 32 bits first, `vec2<u32>` |
/// | `vastex_brick_whole_at(brick, voxel)` | all, of labels | the same by a place in the slot: `brick.base + offset * brick.scale` |
/// | `vastex_volume_whole(id, anchor, offset, level)` | all, of labels | the same for one place |
/// | `vastex_volume_feedback(id, anchor, offset, level)` | all | a feedback pixel, `vec4<u32>` |
/// | `vastex_volume_size(id)` | all | size of the volume in voxels, `vec3<u32>` |
///
/// Labels are whole numbers of up to 64 bits. A text for them has the three functions of `whole` in the place
/// of `vastex_brick_sample`, `_exact`, `_nearest` and `vastex_volume_sample`: nothing blends them, and 0 is
/// what ids show that name no volume.
///
/// A place in a volume is `offset: vec3<f32>` voxels of level 0 after the beginning of voxel `anchor:
/// vec3<u32>`, the same for all rays of a draw; beyond its faces the last voxels go on. What is drawn is as
/// exact as the offset: below 2^16 voxels, 1/128 of one.
///
/// For a group each member `NAME` has these functions, where they name a texture, with its name after the
/// first words: `vastex_sample_NAME(id, uv)`, `vastex_sample_NAME_grad(id, uv, ddx, ddy)`,
/// `vastex_feedback_NAME(id, view, uv)` for a member by itself, `vastex_inspect_NAME(id, uv)`,
/// `vastex_level_of_NAME(id, ddx, ddy)`. `vastex_feedback(id, view, uv)` and its kin without a name are for
/// all members together that are sampled at `uv`: they take the id of the group, and levels and fixed-point
/// places are those of the member with the most texels. What they ask for is the level that the filter with
/// the most taps among the members' needs. `struct VastexIds` has a field for each of these ids: `all`, and
/// the members' names.
///
/// `uv` is 0 to 1 over the texture, beyond that by its address modes; x to the right, y downward. A 32-bit uv
/// tells 2^20 texels apart along an axis: functions that take one show, and ask for, no level with more. In
/// fixed point there is no such limit: `anchor: vec2<u32>` is a texel of level 0, the same for all corners of
/// a draw, and `offset: vec2<f32>` counts texels of level 0 from its beginning, up to 2^30 either way; beyond
/// the edges the address modes hold. What is drawn is as exact as the offset: below 2^16 texels, 1/128 of
/// one.
///
/// Layers whose values may not be mixed ([`Kind::is_mixed`](crate::Kind::is_mixed)) are read as by
/// `vastex_sample_nearest`, or `vastex_brick_nearest`, whatever is called.
///
/// `position` is `@builtin(position)`. What `vastex_report` is given is best computed only where it is asked
/// for:
///
/// ```wgsl
/// let ddx = dpdx(uv);
/// let ddy = dpdy(uv);
/// if vastex_asked(view, position) {
///     vastex_report(view, position, vastex_feedback_grad(id, view, uv, ddx, ddy));
/// }
/// ```
///
/// after every `discard`, since what is reported stays reported. In a feedback pass `vastex_gradients` gives
/// gradients that are better than `vastex_feedback(id, view, uv)` finds by itself, between pixels that stand
/// 8 apart; there, a fragment that is not kept is discarded.
///
/// A uv that goes on beyond 1, as on a tiled plane, has gradients as it is. One that is folded or computed,
/// so that it jumps from 1 to 0 between two pixels, looks to derivatives like a whole turn within a pixel,
/// which is the coarsest level along the seam: `_wrapped` takes the shorter way. The two cannot be told apart
/// in a shader, so the application says which it has.
pub fn wgsl(kinds: &Kinds, place: BindingPlace) -> String {
    let bindings = Bindings::new(kinds, place.first);
    let mode = kinds.mode();
    let mut text = constants_of(kinds, place, &bindings);
    let mut push = |modules: &[&str], renamed: &dyn Fn(&str) -> String| {
        for module in modules {
            text.push('\n');
            text.push_str(&renamed(module));
        }
    };
    let as_it_is = |module: &str| module.to_owned();
    push(&shared_modules(kinds), &as_it_is);
    for (nth, pool) in kinds.text_pools().iter().enumerate() {
        push(&pool_modules(pool, mode, kinds.fade()), &|module| numbered(module, "POOL", nth));
    }
    for (nth, layer) in kinds.layers().iter().enumerate() {
        let of_pool = |module: &str| numbered(module, "POOL", layer.pool);
        let dims = kinds.text_pools()[layer.pool].dims;
        push(atlas_modules(layer.atlas, dims), &|module| numbered(&of_pool(module), "LAYER", nth));
    }
    for (nth, read) in kinds.reads().iter().enumerate().filter(|(_, read)| dims_of(kinds, read) == Dims::D2) {
        push(&filter_modules(read, kinds.fade()), &|module| of_read(module, kinds, nth));
        push(&[SAMPLE], &|module| of_read(module, kinds, nth));
    }
    for member in kinds.members() {
        let of_member =
            |module: &str| names::named(&of_read(module, kinds, member.read), member.name.as_deref());
        let read = &kinds.reads()[member.read];
        let names: &[&str] = match (dims_of(kinds, read), kinds.layers()[read.layer].atlas) {
            (Dims::D2, _) => &[NAMES_SAMPLE, NAMES_FEEDBACK],
            (Dims::D3, Atlas::Whole) => &[NAMES_BRICK, NAMES_BRICK_WHOLE, NAMES_BRICK_FEEDBACK],
            (Dims::D3, _) if read.filter == Filter::Nearest => {
                &[NAMES_BRICK, NAMES_BRICK_VALUES, NAMES_BRICK_UNBLENDED, NAMES_BRICK_FEEDBACK]
            }
            (Dims::D3, _) => &[NAMES_BRICK, NAMES_BRICK_VALUES, NAMES_BRICK_BLENDED, NAMES_BRICK_FEEDBACK],
        };
        push(names, &of_member);
    }
    if kinds.is_group() {
        let of_all = |module: &str| {
            let all = ["POOL", "LAYER", "KIND"]
                .iter()
                .fold(module.to_owned(), |module, marker| module.replace(&format!("_{marker}"), "_ALL"));
            names::named(&all, None)
        };
        let of_dims = [(Dims::D2, NAMES_FEEDBACK), (Dims::D3, NAMES_BRICK_FEEDBACK)];
        let names: Vec<&str> =
            of_dims.iter().filter(|(dims, _)| kinds.has(*dims)).map(|(_, names)| *names).collect();
        push(&names, &of_all);
        let members = kinds.members().iter().filter_map(|member| member.name.as_deref());
        push(&[&names::ids_struct(members)], &as_it_is);
    }
    let mut constants = constants(&text);
    constants.push_str(&text);
    constants
}

/// What a way to read a layer reads: images or volumes.
fn dims_of(kinds: &Kinds, read: &TextRead) -> Dims {
    kinds.text_pools()[kinds.layers()[read.layer].pool].dims
}

/// A module of one way to read a layer.
fn of_read(module: &str, kinds: &Kinds, read: usize) -> String {
    let layer = kinds.reads()[read].layer;
    let module = numbered(module, "POOL", kinds.layers()[layer].pool);
    numbered(&numbered(&module, "LAYER", layer), "KIND", read)
}

/// A module with a number in the place of a marker.
fn numbered(module: &str, marker: &str, number: usize) -> String {
    module.replace(&format!("_{marker}"), &format!("_{number}"))
}

/// The constants of a text's pools, layers and ways to read them.
fn constants_of(kinds: &Kinds, place: BindingPlace, bindings: &Bindings) -> String {
    let mut text = String::new();
    let mut push = |name: &str, value: u32| push_constant(&mut text, "VASTEXI", name, value);
    push("GROUP", place.group);
    push("BINDING_PARAMS", bindings.params());
    push("BINDING_VIEWS", bindings.views());
    push("BINDING_SAMPLER", bindings.sampler());
    if let Some(cells) = bindings.cells() {
        push("BINDING_CELLS", cells);
    }
    for nth in 0..kinds.text_pools().len() {
        push(&format!("BINDING_TABLE_{nth}"), bindings.table(nth));
        push(&format!("BINDING_PARAMS_{nth}"), bindings.pool(nth));
        if let Some(fades) = bindings.fades(nth) {
            push(&format!("BINDING_FADES_{nth}"), fades);
        }
        if let Some(ranges) = bindings.ranges(nth) {
            push(&format!("BINDING_RANGES_{nth}"), ranges);
        }
    }
    for (nth, layer) in kinds.layers().iter().enumerate() {
        push(&format!("BINDING_ATLAS_{nth}"), bindings.atlas(nth));
        push(&format!("SCALE_{nth}"), layer.scale);
    }
    for (nth, read) in kinds.reads().iter().enumerate() {
        push(&format!("FILTER_{nth}"), read.filter.code());
        push(&format!("TAPS_{nth}"), read.filter.max_taps());
    }
    for (nth, pool) in kinds.text_pools().iter().enumerate() {
        push_flag(&mut text, &nth.to_string(), pool.pages == PageSides::PowersOfTwo);
    }
    if kinds.is_group() {
        // What all members want together is what the finest of them needs, in pages of any sides.
        let most_taps = kinds.reads().iter().map(|read: &TextRead| read.filter.max_taps()).max();
        push_constant(&mut text, "VASTEXI", "TAPS_ALL", most_taps.unwrap_or(1));
        push_flag(&mut text, "ALL", false);
    }
    text
}

fn push_flag(text: &mut String, of: &str, are_powers: bool) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "const VASTEXI_POWERS_{of}: bool = {are_powers};");
}

fn shared_modules(kinds: &Kinds) -> Vec<&'static str> {
    let is_round = kinds.reads().iter().all(|read| read.filter.max_taps() == 1);
    let footprint = if is_round { FOOTPRINT_ROUND } else { FOOTPRINT };
    let mut modules = vec![PARAMS, PARAM, RECORDS, LAMBDA, footprint, LEVELS, POSITION, PAGE, PLACE];
    if kinds.reads().iter().any(|read| reaches(read.filter)) {
        modules.push(REACH);
    }
    if kinds.reads().iter().any(|read| read.filter == Filter::Bicubic) {
        modules.push(CUBIC);
    }
    modules.extend([FEEDBACK, VIEW, INSPECT, TEXTURE_SPACE]);
    if kinds.has(Dims::D3) {
        modules.extend([VOLUME_RECORDS, BRICK]);
    }
    modules.extend(report_modules(kinds.mode()));
    modules
}

/// Returns true if a filter takes taps beyond the four of a place.
fn reaches(filter: Filter) -> bool {
    matches!(filter, Filter::Anisotropic(_) | Filter::Bicubic)
}

fn report_modules(mode: FeedbackMode) -> &'static [&'static str] {
    match mode {
        FeedbackMode::Inline => &[REPORTS, REPORT],
        FeedbackMode::Separate | FeedbackMode::Raw => &[REPORT_NOTHING],
    }
}

fn pool_modules(pool: &TextPool, mode: FeedbackMode, fade: bool) -> Vec<&'static str> {
    let mut modules = vec![if mode == FeedbackMode::Raw { ARENA_TEXTURE } else { ARENA_BUFFER }];
    modules.extend(match (pool.dims, pool.tables) {
        (Dims::D2, TableKind::Direct) => [DIRECT, POOL].as_slice(),
        (Dims::D2, TableKind::Hashed) => &[HASHED_POOL, HASHED, POOL],
        (Dims::D3, TableKind::Direct) => &[BRICK_DIRECT, BRICK_POOL],
        (Dims::D3, TableKind::Hashed) => &[HASHED_POOL, BRICK_HASHED, BRICK_POOL],
    });
    // Bricks do not fade in.
    if fade && pool.dims == Dims::D2 {
        modules.push(FADES);
    }
    modules
}

fn filter_modules(read: &TextRead, fade: bool) -> Vec<&'static str> {
    let [shown, shown_reach] = if fade && read.is_mixed { [FADE, FADE_REACH] } else { [SHOWN, SHOWN_REACH] };
    match read.filter {
        Filter::Nearest => vec![shown, FILTER_NEAREST],
        Filter::Bilinear | Filter::Trilinear => vec![shown, FILTER_PLAIN],
        Filter::Anisotropic(_) => vec![shown, shown_reach, FILTER_LEVELS, FILTER_ANISOTROPIC],
        Filter::Bicubic => vec![shown, shown_reach, FILTER_LEVELS, FILTER_BICUBIC],
    }
}

fn atlas_modules(atlas: Atlas, dims: Dims) -> &'static [&'static str] {
    match (dims, atlas) {
        (Dims::D2, Atlas::Float) => &[ATLAS_FLOAT],
        (Dims::D2, Atlas::Unfiltered) => &[ATLAS_UNFILTERED, TAPS],
        (Dims::D2, Atlas::Uint16) => &[ATLAS_UINT16, TAPS],
        (Dims::D2, Atlas::Uint16Rgba) => &[ATLAS_UINT16_RGBA, TAPS],
        (Dims::D3, Atlas::Float) => &[ATLAS_FLOAT_3D, TAPS_3D],
        (Dims::D3, Atlas::Unfiltered) => &[ATLAS_UNFILTERED_3D, TAP_3D, TAPS_3D],
        (Dims::D3, Atlas::Uint16) => &[ATLAS_UINT16_3D, TAP_3D, TAPS_3D],
        (Dims::D3, Atlas::Uint16Rgba) => &[ATLAS_UINT16_RGBA_3D, TAP_3D, TAPS_3D],
        (Dims::D3, Atlas::HighLow) => &[ATLAS_HIGH_LOW_3D, TAPS_3D],
        (Dims::D3, Atlas::Whole) => &[ATLAS_WHOLE_3D],
        // No description of an image has such a layer, and no pool holds one.
        (Dims::D2, Atlas::Whole | Atlas::HighLow) => &[],
    }
}

/// The texts of the compute shaders that this crate itself hands to a device, with their names.
pub fn compute_texts() -> [(&'static str, String); 3] {
    [("tables", pool_tables_wgsl()), ("compact", compact_wgsl()), ("inline", inline_wgsl())]
}

/// The shader that changes the page tables of pools.
pub(crate) fn pool_tables_wgsl() -> String {
    joined(&[POOL_TABLES])
}

/// The shader that compacts feedback targets.
pub(crate) fn compact_wgsl() -> String {
    joined(&[COMPACT])
}

/// The shader that makes a feedback target's pixels of what a main pass reported.
pub(crate) fn inline_wgsl() -> String {
    joined(&[REPORTS, INLINE])
}

fn joined(modules: &[&str]) -> String {
    let text = modules.join("\n");
    constants(&text) + &text
}

/// The constants that a text names, and those that applications may.
fn constants(text: &str) -> String {
    let mut known: Vec<(String, u32)> =
        shader_constants::WGSL.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
    let mut know = |name: &str, value| known.push((name.to_owned(), value));
    know("NONE", u32::MAX);
    know("RECORDS", RECORDS_OF_CELL);
    know("RECORD_HEAD", RECORD_HEAD as u32);
    know("RECORD_LEVEL", RECORD_LEVEL as u32);
    know("RECORD_VOLUME_LEVEL", RECORD_VOLUME_LEVEL as u32);
    know("RANGE_COLUMNS", RANGE_COLUMNS);
    know("NUMBER_MASK", (1 << shader_constants::TEXTURE_BITS) - 1);
    know("VIEWS", VIEWS);
    let modes = [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];
    for (name, mode) in ["CLAMP", "WRAP", "MIRROR", "BORDER"].into_iter().zip(modes) {
        know(&format!("ADDRESS_{name}"), address_code(mode));
    }
    for (name, filter) in
        ["NEAREST", "BILINEAR", "TRILINEAR", "ANISOTROPIC", "BICUBIC"].into_iter().zip(Filter::KINDS)
    {
        know(&format!("FILTER_{name}"), filter.code());
    }
    // On a line of its own, whatever the text before it ends with.
    let mut constants = String::from("\n");
    for (name, value) in &known {
        let is_public = PUBLIC_CONSTANTS.contains(&&**name);
        let is_compared = COMPARED_CONSTANTS.iter().any(|begin| name.starts_with(begin));
        for prefix in ["VASTEX", "VASTEXI"] {
            let is_always = if prefix == "VASTEX" { is_public } else { is_compared };
            if is_always || text.contains(&format!("{prefix}_{name}")) {
                push_constant(&mut constants, prefix, name, *value);
            }
        }
    }
    constants
}

fn push_constant(text: &mut String, prefix: &str, name: &str, value: u32) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "const {prefix}_{name}: u32 = {value}u;");
}

#[cfg(test)]
pub(crate) mod tests;
