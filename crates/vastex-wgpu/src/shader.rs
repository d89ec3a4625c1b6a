//! Shader text: plain WGSL modules joined by explicit lists, after constants generated from Rust.
//!
//! There is no preprocessor. What varies is a constant (the filter, the bind group) or which of a few small modules
//! with the same functions is in the list (how the atlas is read). For several textures at once the same modules are there once
//! for each, under names of their own (`group`).

use std::fmt::Write as _;

use vastex_core::{AddressMode, Geometry, Level, shader_constants};

use crate::bind;
use crate::filter::Filter;
use crate::mirror::{RECORDS, address_code};
use crate::way::FeedbackWay;

pub(crate) mod group;

const PARAMS: &str = include_str!("wgsl/params.wgsl");
const BINDINGS: &str = include_str!("wgsl/bindings.wgsl");
const LAMBDA: &str = include_str!("wgsl/lambda.wgsl");
const FOOTPRINT: &str = include_str!("wgsl/footprint.wgsl");
const LEVEL: &str = include_str!("wgsl/level.wgsl");
const POSITION: &str = include_str!("wgsl/position.wgsl");
const PAGE: &str = include_str!("wgsl/page.wgsl");
const TABLE_TEXTURE: &str = include_str!("wgsl/table_texture.wgsl");
const TABLE_BUFFER: &str = include_str!("wgsl/table_buffer.wgsl");
const HASHED: &str = include_str!("wgsl/hashed.wgsl");
const LOOKUP: &str = include_str!("wgsl/lookup.wgsl");
const ATLAS_FLOAT: &str = include_str!("wgsl/atlas_float.wgsl");
const ATLAS_UNFILTERED: &str = include_str!("wgsl/atlas_unfiltered.wgsl");
const ATLAS_UINT16: &str = include_str!("wgsl/atlas_uint16.wgsl");
const ATLAS_UINT16_RGBA: &str = include_str!("wgsl/atlas_uint16_rgba.wgsl");
const TAPS: &str = include_str!("wgsl/taps.wgsl");
const REACH: &str = include_str!("wgsl/reach.wgsl");
const CUBIC: &str = include_str!("wgsl/cubic.wgsl");
const SHOWN: &str = include_str!("wgsl/shown.wgsl");
const SHOWN_REACH: &str = include_str!("wgsl/shown_reach.wgsl");
const FADE: &str = include_str!("wgsl/fade.wgsl");
const FADE_REACH: &str = include_str!("wgsl/fade_reach.wgsl");
const FILTER_PLAIN: &str = include_str!("wgsl/filter_plain.wgsl");
const FILTER_ANISOTROPIC: &str = include_str!("wgsl/filter_anisotropic.wgsl");
const FILTER_BICUBIC: &str = include_str!("wgsl/filter_bicubic.wgsl");
const SAMPLE: &str = include_str!("wgsl/sample.wgsl");
const SAMPLE_FIXED: &str = include_str!("wgsl/sample_fixed.wgsl");
const VIEW: &str = include_str!("wgsl/view.wgsl");
const FEEDBACK: &str = include_str!("wgsl/feedback.wgsl");
const FEEDBACK_FIXED: &str = include_str!("wgsl/feedback_fixed.wgsl");
const INSPECTION: &str = include_str!("wgsl/inspection.wgsl");
const INSPECT: &str = include_str!("wgsl/inspect.wgsl");
const TEXTURE_SPACE: &str = include_str!("wgsl/texture_space.wgsl");
const TOLD: &str = include_str!("wgsl/told.wgsl");
const TELL: &str = include_str!("wgsl/tell.wgsl");
const TELL_NOTHING: &str = include_str!("wgsl/tell_nothing.wgsl");
const INLINE: &str = include_str!("wgsl/inline.wgsl");
const TABLE: &str = include_str!("wgsl/table.wgsl");
const COMPACT: &str = include_str!("wgsl/compact.wgsl");

/// How a shader reads the atlas, which follows from the layer's format: [`crate::Pool::atlas`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Atlas {
    /// The device's own filter.
    #[default]
    Float,
    /// Floats that the device does not filter, so the shader does.
    Unfiltered,
    /// One channel of 16-bit whole numbers, filtered in the shader.
    Uint16,
    /// Four channels of 16-bit whole numbers, filtered in the shader.
    Uint16Rgba,
}

impl Atlas {
    /// Every way.
    pub const ALL: [Atlas; 4] = [Atlas::Float, Atlas::Unfiltered, Atlas::Uint16, Atlas::Uint16Rgba];
}

/// What an application's shader text is made for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ShaderOptions {
    /// Index of the bind group made from a [`crate::BindLayout`] in the application's pipeline layout.
    pub group: u32,
    /// How texels are blended.
    pub filter: Filter,
    /// How the atlas is read.
    pub atlas: Atlas,
    /// How feedback is gathered.
    pub feedback: FeedbackWay,
    /// Which page tables there may be.
    pub tables: TableKinds,
    /// Which pages there may be.
    pub pages: PageSides,
    /// Whether tiles fade in ([`crate::Fades`]). Where they do not, the text knows nothing of it.
    pub fade: bool,
}

/// The kinds of page tables that a shader reads. One that reads either asks the texture, which is nothing to a GPU but for some
/// registers, and a quarter of a sample's cost to a software driver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TableKinds {
    /// Direct and hashed.
    #[default]
    Either,
    /// Direct ones alone.
    Direct,
    /// Hashed ones alone.
    Hashed,
}

impl TableKinds {
    pub(crate) const fn code(self) -> u32 {
        match self {
            TableKinds::Either => 0,
            TableKinds::Direct => 1,
            TableKinds::Hashed => 2,
        }
    }
}

/// The sides of pages, in texels of level 0, that a shader knows of. One that knows them to be powers of two shifts where another
/// divides, eight times for a trilinear sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PageSides {
    /// Whatever they are.
    #[default]
    Any,
    /// Powers of two on every level finer than the tail.
    PowersOfTwo,
}

impl PageSides {
    /// Those of a texture.
    pub fn of(geometry: &Geometry) -> PageSides {
        let (finer, page) = (usize::from(geometry.tail().first_level()), geometry.page());
        let is_fit =
            |level: &Level| (0..2).all(|a| page[a].is_power_of_two() && level.scale[a].is_power_of_two());
        if geometry.levels()[..finer].iter().all(is_fit) { PageSides::PowersOfTwo } else { PageSides::Any }
    }

    pub(crate) const fn code(self) -> u32 {
        match self {
            PageSides::Any => 0,
            PageSides::PowersOfTwo => 1,
        }
    }
}

/// The WGSL that an application puts after its own shader: `MY_SHADER.to_owned() + &wgsl(&options)`.
///
/// So the application's `enable`, `requires` and `diagnostic` directives, which WGSL has before everything else, stay first, and errors in
/// its text are reported at its own lines; declarations may stand in any order. The text has no directives of its own and begins on a
/// line of its own.
///
/// All names begin with `vastex_`, `Vastex` or `VASTEX_`. To be called, by stage and by what is known there:
///
/// | function | stages | gives |
/// |---|---|---|
/// | `vastex_sample(uv)` | fragment, uniform control flow | the texture, `vec4<f32>` |
/// | `vastex_sample_wrapped(uv)` | fragment, uniform control flow | the same, where uv jumps from 1 to 0 at a seam |
/// | `vastex_sample_grad(uv, ddx, ddy)` | all | the same, from gradients of uv |
/// | `vastex_sample_level(uv, level)` | all | the same, at an explicit level |
/// | `vastex_feedback(uv)` | fragment, uniform control flow | a feedback pixel, `vec4<u32>` |
/// | `vastex_feedback_wrapped(uv)` | fragment, uniform control flow | the same, for `vastex_sample_wrapped` |
/// | `vastex_feedback_grad(uv, ddx, ddy)` | all | the same, from gradients of uv |
/// | `vastex_feedback_level(uv, level)` | all | the same, for an explicit level |
/// | `vastex_sample_fixed(anchor, offset)` | fragment, uniform control flow | the texture, at a place in fixed point |
/// | `vastex_feedback_fixed(anchor, offset)` | fragment, uniform control flow | a feedback pixel for it |
/// | either with `_grad(.., ddx, ddy)`, `_level(.., level)` | all | the same, from gradients of the offset, or at a level |
/// | `vastex_tell(position, wanted)` | fragment, main pass | nothing; tells such a pixel where feedback is inline |
/// | `vastex_asked(position)` | fragment, main pass | whether that would tell it in this frame |
/// | `vastex_keeps(position, opacity)` | fragment | whether a surface that is not opaque is to say here what it wants |
/// | `vastex_gradients(position, uv)` | fragment, uniform control flow | gradients of uv, exact on flat triangles |
/// | `vastex_feedback_clip(clip)` | vertex, feedback pass only | the clip position in the feedback target |
/// | `vastex_texture_space_clip(uv)` | vertex, texture space only | the clip position in texture space |
/// | `vastex_texture_space(uv, clip, picture)` | fragment, texture space only | the level that a picture needs, `vec4<f32>` |
/// | `vastex_texture_space_front(uv, clip, picture)` | the same | the same, where the texture is not mirrored |
/// | `vastex_inspect(uv)` | fragment, uniform control flow | levels wanted and shown, page and place, `VastexInspection` |
/// | `vastex_inspect_grad(uv, ddx, ddy)` | all | the same, from gradients of uv |
/// | `vastex_turn(position, count)` | fragment, feedback pass only | see [`crate::group_wgsl()`] |
///
/// `uv` is 0 to 1 over the texture, beyond that by its address modes; x to the right, y downward. It is for textures of up to
/// 2^16 texels per axis. In fixed point there is no such limit: `anchor: vec2<u32>` is a texel of level 0, the same for all
/// corners of a draw, and `offset: vec2<f32>` counts texels of level 0 from its beginning, up to 2^30 either way; beyond the
/// edges the address modes hold. What is drawn is as exact as the offset: below 2^16 texels, 1/128 of one.
///
/// `position` is `@builtin(position)`. What `vastex_tell` is given is best computed only where it is asked for:
///
/// ```wgsl
/// let ddx = dpdx(uv);
/// let ddy = dpdy(uv);
/// if vastex_asked(position) {
///     vastex_tell(position, vastex_feedback_grad(uv, ddx, ddy));
/// }
/// ```
///
/// after every `discard`, since what is told stays told. In a feedback pass `vastex_gradients` gives gradients that are better than
/// `vastex_feedback(uv)` finds by itself, between pixels that stand 8 apart; there, a fragment that is not kept is discarded.
///
/// A uv that goes on beyond 1, as on a tiled plane, has gradients as it is. One that is folded or computed, so that it jumps from 1
/// to 0 between two pixels, looks to derivatives like a whole turn within a pixel, which is the coarsest level along the seam:
/// `_wrapped` takes the shorter way. The two cannot be told apart in a shader, so the application says which it has.
pub fn wgsl(options: &ShaderOptions) -> String {
    let mut text = constants();
    push_constant(&mut text, "GROUP", options.group);
    push_filter(&mut text, options.filter);
    push_constant(&mut text, "TABLES", options.tables.code());
    push_constant(&mut text, "PAGES", options.pages.code());
    if options.fade {
        push_constant(&mut text, "BINDING_FADES", bind::FADES);
    }
    text.push('\n');
    text += &table_binding("VASTEX_BINDING_TABLE", "vastex_table", options.feedback);
    if options.fade {
        text += &fades_binding("VASTEX_BINDING_FADES", "vastex_fades");
    }
    let shared: &[&str] = &[PARAMS, BINDINGS, LAMBDA, POSITION, CUBIC, VIEW, INSPECTION];
    join(
        text,
        &[
            shared,
            tell_modules(options.feedback),
            &[FOOTPRINT, LEVEL, PAGE, table_module(options.feedback), HASHED, LOOKUP],
            atlas_modules(options.atlas),
            &filter_modules(options.filter, options.fade),
            &[SAMPLE, SAMPLE_FIXED, FEEDBACK, FEEDBACK_FIXED, TEXTURE_SPACE, INSPECT],
        ]
        .concat(),
    )
}

fn tell_modules(way: FeedbackWay) -> &'static [&'static str] {
    match way {
        FeedbackWay::Inline => &[TOLD, TELL],
        FeedbackWay::Separate | FeedbackWay::Raw => &[TELL_NOTHING],
    }
}

/// How a page table is bound, and the module that reads it.
fn table_binding(binding: impl std::fmt::Display, name: &str, way: FeedbackWay) -> String {
    let declared = match way {
        FeedbackWay::Raw => format!("var {name}: texture_2d<u32>"),
        FeedbackWay::Separate | FeedbackWay::Inline => format!("var<storage, read> {name}: array<u32>"),
    };
    format!("@group(VASTEX_GROUP) @binding({binding}) {declared};\n")
}

fn table_module(way: FeedbackWay) -> &'static str {
    if way == FeedbackWay::Raw { TABLE_TEXTURE } else { TABLE_BUFFER }
}

/// How the fades of a pool are bound.
fn fades_binding(binding: impl std::fmt::Display, name: &str) -> String {
    format!("@group(VASTEX_GROUP) @binding({binding}) var {name}: texture_2d_array<u32>;\n")
}

fn filter_modules(filter: Filter, fade: bool) -> Vec<&'static str> {
    let [shown, shown_reach] = if fade { [FADE, FADE_REACH] } else { [SHOWN, SHOWN_REACH] };
    match filter {
        Filter::Nearest | Filter::Bilinear | Filter::Trilinear => vec![shown, FILTER_PLAIN],
        Filter::Anisotropic(_) => vec![REACH, shown, shown_reach, FILTER_ANISOTROPIC],
        Filter::Bicubic => vec![REACH, shown, shown_reach, FILTER_BICUBIC],
    }
}

fn atlas_modules(atlas: Atlas) -> &'static [&'static str] {
    match atlas {
        Atlas::Float => &[ATLAS_FLOAT],
        Atlas::Unfiltered => &[ATLAS_UNFILTERED, TAPS],
        Atlas::Uint16 => &[ATLAS_UINT16, TAPS],
        Atlas::Uint16Rgba => &[ATLAS_UINT16_RGBA, TAPS],
    }
}

/// The texts of the compute shaders that this crate itself hands to a device, with their names.
pub fn compute_texts() -> [(&'static str, String); 3] {
    [("table", table_wgsl()), ("compact", compact_wgsl()), ("inline", inline_wgsl())]
}

/// The shader that changes page tables.
pub(crate) fn table_wgsl() -> String {
    join(constants(), &[PARAMS, TABLE])
}

/// The shader that compacts feedback targets.
pub(crate) fn compact_wgsl() -> String {
    join(constants(), &[COMPACT])
}

/// The shader that makes a feedback target's pixels of what a main pass told.
pub(crate) fn inline_wgsl() -> String {
    join(constants(), &[TOLD, INLINE])
}

fn constants() -> String {
    // On a line of its own, whatever the text before it ends with.
    let mut text = String::from("\n");
    for &(name, value) in shader_constants::WGSL.iter().chain(bind::BINDINGS) {
        push_constant(&mut text, name, value);
    }
    push_constant(&mut text, "NONE", u32::MAX);
    push_constant(&mut text, "TABLES_DIRECT", TableKinds::Direct.code());
    push_constant(&mut text, "TABLES_HASHED", TableKinds::Hashed.code());
    push_constant(&mut text, "PAGES_POWERS_OF_TWO", PageSides::PowersOfTwo.code());
    push_constant(&mut text, "RECORDS", RECORDS);
    let modes = [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];
    for (name, mode) in ["CLAMP", "WRAP", "MIRROR", "BORDER"].into_iter().zip(modes) {
        push_constant(&mut text, &format!("ADDRESS_{name}"), address_code(mode));
    }
    for (name, filter) in
        ["NEAREST", "BILINEAR", "TRILINEAR", "ANISOTROPIC", "BICUBIC"].into_iter().zip(Filter::KINDS)
    {
        push_constant(&mut text, &format!("FILTER_{name}"), filter.code());
    }
    text
}

fn push_filter(text: &mut String, filter: Filter) {
    push_constant(text, "FILTER", filter.code());
    push_constant(text, "MAX_TAPS", filter.max_taps());
}

fn push_constant(text: &mut String, name: &str, value: u32) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "const VASTEX_{name}: u32 = {value}u;");
}

fn join(mut text: String, modules: &[&str]) -> String {
    for module in modules {
        text.push('\n');
        text.push_str(module);
    }
    text
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Parses and validates a shader as a device with WebGPU's capabilities would.
    pub(crate) fn module(text: &str) -> naga::Module {
        let module =
            naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        let flags = naga::valid::ValidationFlags::all();
        let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        module
    }

    /// An application that calls the whole public surface.
    const APPLICATION: &str = "
        @vertex fn vertex(@location(0) at: vec4<f32>) -> @builtin(position) vec4<f32> {
            return vastex_feedback_clip(at) + vastex_sample_level(at.xy, 1.0);
        }
        @fragment fn main_pass(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
            if vastex_asked(at) && vastex_keeps(at, 0.5) {
                vastex_tell(at, vastex_feedback_grad(at.xy, at.yx, at.zw));
            }
            let inspected = vastex_inspect(at.xy);
            let slot = vastex_inspect_slot(vastex_inspect_page(inspected.page, inspected.shown), at.xy);
            return slot + vastex_sample(at.xy) + vastex_sample_wrapped(at.xy) + vastex_sample_grad(at.xy, at.yx, at.zw)
                + vastex_sample_fixed(vec2<u32>(7u), at.xy) + vastex_sample_fixed_grad(vec2<u32>(7u), at.xy, at.yx, at.zw)
                + vastex_sample_fixed_level(vec2<u32>(7u), at.xy, 1.0);
        }
        @fragment fn feedback_pass(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
            let along = vastex_gradients(at, at.yx);
            return vastex_feedback(at.xy) + vastex_feedback_wrapped(at.xy) + vastex_feedback_grad(at.xy, along[0], along[1])
                + vastex_feedback_level(at.xy, 1.0) + vastex_feedback_fixed(vec2<u32>(7u), at.xy)
                + vastex_feedback_fixed_grad(vec2<u32>(7u), at.xy, at.yx, at.zw)
                + vastex_feedback_fixed_level(vec2<u32>(7u), at.xy, 1.0);
        }
        @fragment fn texture_space(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
            return vastex_texture_space(at.xy, at, at.zw) + vastex_texture_space_front(at.xy, at, at.zw)
                + vastex_texture_space_clip(at.xy);
        }";

    #[test]
    fn every_variant_of_the_text_for_applications_is_valid() {
        for filter in Filter::KINDS {
            for atlas in Atlas::ALL {
                for (group, feedback) in [0, 1, 2].into_iter().zip(FeedbackWay::ALL.iter().copied().cycle()) {
                    let tables =
                        [TableKinds::Either, TableKinds::Direct, TableKinds::Hashed][group as usize % 3];
                    let pages = [PageSides::Any, PageSides::PowersOfTwo][group as usize % 2];
                    for fade in [false, true] {
                        let options = ShaderOptions { group, filter, atlas, feedback, tables, pages, fade };
                        let module = module(&(APPLICATION.to_owned() + &wgsl(&options)));
                        let bindings = module.global_variables.iter().filter_map(|(_, v)| v.binding);
                        let groups: Vec<_> = bindings.map(|binding| binding.group).collect();
                        let bound = 6 + usize::from(feedback == FeedbackWay::Inline) + usize::from(fade);
                        assert_eq!(groups, vec![group; bound]);
                    }
                }
            }
        }
    }

    /// Texts for one texture and for a group of one.
    fn texts() -> [String; 2] {
        let member = group::GroupMember {
            name: "a".to_owned(),
            texture: 0,
            atlas: Atlas::Float,
            tables: TableKinds::Either,
            pages: PageSides::Any,
            filter: None,
            fades: true,
        };
        let shape = group::GroupShape::new(vec![member], true).unwrap();
        let group = group::group_wgsl(0, Filter::Trilinear, FeedbackWay::Separate, &shape);
        [wgsl(&ShaderOptions::default()), group]
    }

    #[test]
    fn directives_of_an_application_stay_first() {
        let directives = "enable f16;\nrequires readonly_and_readwrite_storage_textures;\n\
                          diagnostic(off, derivative_uniformity);\n";
        let shader = "@fragment fn shade(@location(0) uv: vec2<f32>) -> @location(0) vec4<f32> {\n\
                          return vec4<f32>(vec4<f16>(vastex_feedback_level(uv, f32(1.0h)))); }\n\
                      // a comment without an end of its line";
        for text in texts() {
            let parsed = |text: &str| naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text));
            let parsed_so = parsed(&(directives.to_owned() + shader + &text));
            assert!(parsed_so.is_ok(), "{}", parsed_so.unwrap_err());
            assert!(parsed(&(text + directives + shader)).is_err(), "directives come first in WGSL");
        }
    }

    #[test]
    fn a_mistake_in_an_applications_text_is_told_at_its_own_line() {
        let shader =
            "fn fine() -> f32 { return 1.0; }\n\nfn broken() -> f32 {\n    return vastex_no_such(1.0);\n}\n";
        for text in texts() {
            let text = shader.to_owned() + &text;
            let error = naga::front::wgsl::parse_str(&text).unwrap_err();
            let place = error.location(&text).unwrap();
            assert_eq!((place.line_number, place.line_position), (4, 12), "{error}");
        }
    }

    #[test]
    fn where_tiles_do_not_fade_the_text_knows_nothing_of_it() {
        for filter in Filter::KINDS {
            let text = |fade| wgsl(&ShaderOptions { filter, fade, ..Default::default() });
            let knows = |text: &str| text.contains("vastex_fades") || text.contains("VASTEX_BINDING_FADES");
            assert!(knows(&text(true)) && !knows(&text(false)), "{filter}");
            assert!(!text(false).contains("vastex_old_share"), "{filter}");
        }
    }

    #[test]
    fn feedback_is_the_same_whether_tiles_fade_or_not() {
        for module in [FEEDBACK, FEEDBACK_FIXED, LEVEL, PAGE, VIEW, TELL, INSPECT, TEXTURE_SPACE] {
            assert!(!module.contains("vastex_shown") && !module.contains("vastex_filtered"));
        }
    }

    #[test]
    fn every_shader_of_our_own_is_valid() {
        assert_eq!(module(&table_wgsl()).entry_points.len(), 4);
        assert_eq!(module(&compact_wgsl()).entry_points.len(), 2);
        assert_eq!(module(&inline_wgsl()).entry_points.len(), 2);
    }
}
