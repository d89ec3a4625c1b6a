//! What the texts of every kind must be: valid, without what they do not need, and of the names that are
//! promised.

use super::*;
use crate::bind::layout_entries;
use crate::kind::{Kind, KindMember};
use crate::needed::only_needed;

/// Parses and validates a shader as a device with WebGPU's capabilities would.
pub(crate) fn module(text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    module
}

const SURFACE: &str = include_str!("../../tests/gpu/wgsl/whole_surface.wgsl");

fn kind(atlas: Atlas, filter: Filter, tables: TableKind) -> Kind {
    let (dims, pages) = (Dims::D2, PageSides::PowersOfTwo);
    Kind { dims, tables, pages, layer: 0, atlas, scale: 1, filter, is_mixed: true }
}

fn member(name: &str, pool: usize, kind: Kind) -> KindMember {
    KindMember { name: name.to_owned(), pool, kind }
}

/// A color and a height of one pool, a night of another.
fn planet(atlas: Atlas, filter: Filter, mode: FeedbackMode, fade: bool) -> Kinds {
    let color = kind(Atlas::Float, filter, TableKind::Direct);
    let height = Kind { layer: 1, scale: 2, ..kind(atlas, filter, TableKind::Direct) };
    let night = Kind { pages: PageSides::Any, ..kind(Atlas::Float, filter, TableKind::Hashed) };
    let members = vec![member("color", 0, color), member("height", 0, height), member("night_2", 9, night)];
    Kinds::of_group(members, mode, fade).unwrap()
}

/// An application that calls all that a member has, by its name, or all that there is without one.
fn application(name: Option<&str>) -> String {
    names::named(SURFACE, name)
}

/// The bindings of a bind group, in order.
fn bound(module: &naga::Module, group: u32) -> Vec<u32> {
    let bindings = module.global_variables.iter().filter_map(|(_, v)| v.binding.as_ref());
    let mut bound: Vec<u32> = bindings.filter(|b| b.group == group).map(|b| b.binding).collect();
    bound.sort_unstable();
    bound
}

#[test]
fn every_variant_of_the_text_for_a_kind_is_valid() {
    for filter in Filter::KINDS {
        for atlas in Atlas::ALL {
            for (group, mode) in (0..3).zip(FeedbackMode::ALL) {
                let tables = [TableKind::Direct, TableKind::Hashed][group as usize % 2];
                let pages = [PageSides::Any, PageSides::PowersOfTwo][group as usize % 2];
                for fade in [false, true] {
                    let kinds = Kinds::of(Kind { pages, ..kind(atlas, filter, tables) }, mode, fade);
                    let place = BindingPlace { group, first: 4 * group };
                    let module = module(&(application(None) + &wgsl(&kinds, place)));
                    let entries = layout_entries(&kinds, place.first);
                    let expected: Vec<u32> = entries.iter().map(|entry| entry.binding).collect();
                    assert_eq!(bound(&module, group), expected);
                    assert_eq!(expected[0], place.first);
                }
            }
        }
    }
}

#[test]
fn every_variant_of_the_text_for_groups_is_valid() {
    for filter in Filter::KINDS {
        for atlas in Atlas::ALL {
            for (mode, fade) in
                [(FeedbackMode::Inline, false), (FeedbackMode::Raw, true), (FeedbackMode::Separate, true)]
            {
                let kinds = planet(atlas, filter, mode, fade);
                let text = wgsl(&kinds, BindingPlace { group: 2, first: 5 });
                for name in ["color", "height", "night_2"] {
                    let module = module(&(application(Some(name)) + &text));
                    let entries = layout_entries(&kinds, 5);
                    let expected: Vec<u32> = entries.iter().map(|entry| entry.binding).collect();
                    assert_eq!(bound(&module, 2), expected);
                }
                let all = "@fragment fn want(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
                        let ids = VastexIds(1u, 2u, 3u, 4u);
                        return vastex_feedback(ids.all, 0u, at.xy)
                            + vastex_feedback_fixed(ids.all, 1u, vec2<u32>(9u), at.xy);
                    }";
                module(&(all.to_owned() + &text));
            }
        }
    }
}

/// Two channels of one pool, one of another that is hashed, and an image.
#[test]
fn every_variant_of_the_text_for_volumes_is_valid() {
    let march = "@fragment fn march(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
            let anchor = vec3<u32>(9u);
            let level = vastex_volume_level_NAME(1u, at.xyz);
            var brick = vastex_brick_NAME(1u, anchor, at.xyz, level);
            let exit = vastex_brick_exit(brick, at.xyz, at.yzx);
            return vastex_brick_sample_NAME(brick, at.xyz + exit) + vastex_brick_nearest_NAME(brick, at.xyz)
                + vastex_brick_exact_NAME(brick, at.xyz)
                + vastex_volume_sample_NAME(1u, anchor, at.xyz, level) * f32(vastex_volume_size(1u).z);
        }
        @fragment fn want(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
            let box = vastex_volume_box_NAME(1u, vec3<u32>(9u), at.xyz, 2.5);
            let exit = vastex_box_exit(box, at.xyz, vastex_volume_scale(1u, vastex_volume_whole_level_NAME(1u, 2.5)));
            let turn = vastex_ray_turn(0u, at, 9u);
            return vastex_volume_feedback_NAME(1u, vec3<u32>(turn), at.xyz + exit, 2.5);
        }";
    // Of labels: what is read is a whole number.
    let labels = "let exit = vastex_brick_exit(brick, at.xyz, at.yzx);
            let read = vastex_brick_whole_NAME(brick, at.xyz) + vastex_brick_whole_at_NAME(brick, at.xyz + exit)
                + vastex_volume_whole_NAME(1u, anchor, at.xyz, level);
            return vec4<f32>(vec2<f32>(read), f32(vastex_volume_size(1u).z), 1.0);
        }
        @fragment fn want";
    let (head, tail) = march.split_once("let exit = vastex_brick_exit").unwrap();
    let labels = [head, labels, tail.split_once("@fragment fn want").unwrap().1].concat();
    for atlas in Atlas::ALL.into_iter().chain([Atlas::HighLow, Atlas::Whole]) {
        let march = if atlas == Atlas::Whole { labels.as_str() } else { march };
        for (tables, mode) in [TableKind::Direct, TableKind::Hashed].into_iter().zip(FeedbackMode::ALL) {
            let volume = |tables, filter| {
                let (dims, pages) = (Dims::D3, PageSides::Any);
                Kind { dims, tables, pages, layer: 0, atlas, scale: 1, filter, is_mixed: true }
            };
            let kinds = Kinds::of(volume(tables, Filter::Trilinear), mode, false);
            let module_of = |text: &str, kinds: &Kinds| {
                let module = module(&(text.to_owned() + &wgsl(kinds, BindingPlace::default())));
                let entries = layout_entries(kinds, 0);
                assert_eq!(bound(&module, 0), entries.iter().map(|entry| entry.binding).collect::<Vec<_>>());
                let is_solid = |entry: &wgpu::BindGroupLayoutEntry| {
                    let view_dimension = wgpu::TextureViewDimension::D3;
                    matches!(entry.ty, wgpu::BindingType::Texture { view_dimension: d, .. } if d == view_dimension)
                };
                entries.into_iter().filter(is_solid).count()
            };
            assert_eq!(module_of(&names::named(march, None), &kinds), 1);
            let other = volume(TableKind::Hashed, Filter::Nearest);
            let members = vec![
                member("density", 0, volume(tables, Filter::Trilinear)),
                member("nuclei", 0, volume(tables, Filter::Trilinear)),
                member("label", 1, other),
                member("ground", 2, kind(Atlas::Float, Filter::Trilinear, TableKind::Direct)),
            ];
            let group = Kinds::of_group(members, mode, false).unwrap();
            let all = "@fragment fn want_all(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {
                    return vastex_volume_feedback(1u, vec3<u32>(9u), at.xyz, 2.5) + vastex_feedback(1u, 0u, at.xy);
                }";
            for name in ["density", "nuclei", "label"] {
                assert_eq!(module_of(&(names::named(march, Some(name)) + all), &group), 2);
            }
        }
    }
}

#[test]
fn what_members_have_in_common_is_in_the_text_once() {
    let one = kind(Atlas::Float, Filter::Trilinear, TableKind::Direct);
    let members = ["a", "b", "c"].map(|name| member(name, 3, one));
    let kinds = Kinds::of_group(members.to_vec(), FeedbackMode::Separate, false).unwrap();
    // Records, views, sampler, and one pool with one layer.
    assert_eq!(layout_entries(&kinds, 0).len(), 6);
    let text = wgsl(&kinds, BindingPlace::default());
    assert_eq!(text.matches("fn vastexi_filtered_").count(), 1);
    let alone = wgsl(&Kinds::of(one, FeedbackMode::Separate, false), BindingPlace::default());
    assert!(text.lines().count() < 2 * alone.lines().count());
}

/// Each member takes the taps of its own filter, and what is asked for all together is asked for as the one
/// with the most taps needs it.
#[test]
fn members_of_a_group_have_the_taps_of_their_filters() {
    let of = |filter| kind(Atlas::Float, filter, TableKind::Direct);
    let anisotropic = "anisotropic16".parse().unwrap();
    let members = [member("label", 0, of(Filter::Nearest)), member("color", 1, of(anisotropic))];
    for members in [members.clone(), [members[1].clone(), members[0].clone()]] {
        let taps = |member: &KindMember| if member.name == "color" { 16 } else { 1 };
        let kinds = Kinds::of_group(members.to_vec(), FeedbackMode::Separate, false).unwrap();
        let text = wgsl(&kinds, BindingPlace::default());
        let told =
            |name: &str, taps: u32| text.contains(&format!("const VASTEXI_TAPS_{name}: u32 = {taps}u;"));
        assert!(told("ALL", 16), "{text}");
        assert!(told("0", taps(&members[0])) && told("1", taps(&members[1])), "{text}");
    }
}

#[test]
fn kinds_by_another_filter_are_others() {
    let kinds = planet(Atlas::Uint16, Filter::Trilinear, FeedbackMode::Separate, false);
    let nearest = kinds.filtered(Filter::Nearest);
    assert_ne!(kinds, nearest);
    assert_eq!(kinds, nearest.filtered(Filter::Trilinear));
    assert_eq!(nearest, planet(Atlas::Uint16, Filter::Nearest, FeedbackMode::Separate, false));
    assert_eq!(kinds.pools().collect::<Vec<_>>(), [0, 2]);
}

/// What is not mixed is nearest, and one kind by whichever filter.
#[test]
fn where_values_are_not_mixed_the_filter_is_nearest_whatever_is_asked_for() {
    let of = |filter| kind(Atlas::Float, filter, TableKind::Direct);
    let label = Kind { is_mixed: false, ..of(Filter::Nearest) };
    for filter in Filter::KINDS {
        assert_eq!(label.filtered(filter), label);
        let kinds = |kind| Kinds::of(kind, FeedbackMode::Separate, false);
        assert_eq!(kinds(Kind { filter, ..label }), kinds(label));
        let members = vec![member("color", 0, of(Filter::Trilinear)), member("label", 0, label)];
        let group = Kinds::of_group(members, FeedbackMode::Separate, false).unwrap();
        let members = vec![member("color", 0, of(filter)), member("label", 0, label)];
        let expected = Kinds::of_group(members, FeedbackMode::Separate, false).unwrap();
        assert_eq!(group.filtered(filter), expected);
        assert_eq!(group.with_filters(&[Some(filter), Some(Filter::Bicubic)]), expected);
    }
    let nearest = of(Filter::Nearest);
    assert_eq!(Kind { is_mixed: true, ..label }, nearest);
    let text = |kind, fade| wgsl(&Kinds::of(kind, FeedbackMode::Separate, fade), BindingPlace::default());
    assert_eq!(text(label, false), text(nearest, false), "where nothing fades they are read alike");
    assert_ne!(text(label, true), text(nearest, true));
}

/// What an application is handed that calls one function is what that takes: of values that may be mixed
/// nothing that reads a texel as it is, of others nothing that blends.
#[test]
fn texts_do_not_test_whether_values_are_mixed() {
    let shade = "@fragment fn shade(@location(0) uv: vec2<f32>) -> @location(0) vec4<f32> {
            return vastex_sample(1u, uv);
        }";
    for (filter, fade) in Filter::KINDS.into_iter().flat_map(|filter| [(filter, false), (filter, true)]) {
        let needed = |is_mixed| {
            let kind = Kind { is_mixed, ..kind(Atlas::Float, filter, TableKind::Direct) };
            let text = wgsl(&Kinds::of(kind, FeedbackMode::Separate, fade), BindingPlace::default());
            only_needed(&(shade.to_owned() + &text)).into_owned()
        };
        let (mixed, unmixed) = (needed(true), needed(false));
        let reads_texels = |text: &str| text.contains("vastexi_texel_0(");
        assert_eq!(reads_texels(&mixed), matches!(filter, Filter::Nearest | Filter::Bicubic), "{filter}");
        assert_eq!(mixed.contains("vastexi_old_share_0("), fade, "{filter}");
        assert!(reads_texels(&unmixed), "{filter}");
        for absent in ["vastexi_old_share", "textureSampleLevel", "mix(", "vastexi_shown_beside"] {
            assert!(!unmixed.contains(absent), "{filter}: {absent}");
        }
        module(&mixed);
        module(&unmixed);
    }
}

/// Texts for one texture and for a group.
fn texts() -> [String; 2] {
    let one =
        Kinds::of(kind(Atlas::Float, Filter::Trilinear, TableKind::Direct), FeedbackMode::Separate, false);
    let group = planet(Atlas::Float, Filter::Trilinear, FeedbackMode::Separate, false);
    [one, group].map(|kinds| wgsl(&kinds, BindingPlace::default()))
}

#[test]
fn directives_of_an_application_stay_first() {
    let directives = "enable f16;\nrequires readonly_and_readwrite_storage_textures;\n\
                      diagnostic(off, derivative_uniformity);\n";
    let shader = "@fragment fn shade(@location(0) uv: vec2<f32>) -> @location(0) vec4<f32> {\n\
                      return vec4<f32>(vec4<f16>(vastex_feedback_level(1u, 0u, uv, f32(1.0h)))); }\n\
                  // a comment without an end of its line";
    for text in texts() {
        let parsed = |text: &str| naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text));
        let parsed_so = parsed(&(directives.to_owned() + shader + &text));
        assert!(parsed_so.is_ok(), "{}", parsed_so.unwrap_err());
        assert!(parsed(&(text + directives + shader)).is_err(), "directives come first in WGSL");
    }
}

#[test]
fn a_mistake_in_an_applications_text_is_reported_at_its_own_line() {
    let shader =
        "fn fine() -> f32 { return 1.0; }\n\nfn broken() -> f32 {\n    return vastex_no_such(1.0);\n}\n";
    for text in texts() {
        let text = shader.to_owned() + &text;
        let error = naga::front::wgsl::parse_str(&text).unwrap_err();
        let place = error.location(&text).unwrap();
        assert_eq!((place.line_number, place.line_position), (4, 12), "{error}");
    }
}

/// What the marks of a module stand for is always put in their places.
#[test]
fn no_mark_is_left_and_what_is_not_public_says_so() {
    for text in texts() {
        let code: String = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect();
        for mark in ["_POOL", "_LAYER", "_KIND", "NAME"] {
            assert!(!code.contains(mark), "{mark}");
        }
        let declared = text.lines().filter_map(|line| line.strip_prefix("fn ")?.split('(').next());
        let public: Vec<&str> = declared.filter(|name| name.starts_with("vastex_")).collect();
        let known = [
            "sample",
            "feedback",
            "report",
            "asked",
            "dither",
            "turn",
            "gradients",
            "pixel",
            "size",
            "level",
            "texture",
            "inspect",
        ];
        let is_known = |name: &&str| name.split('_').nth(1).is_some_and(|word| known.contains(&word));
        assert!(public.len() > 20 && public.iter().all(is_known), "{public:?}");
    }
}

#[test]
fn where_tiles_do_not_fade_the_text_knows_nothing_of_it() {
    for filter in Filter::KINDS {
        let kind = kind(Atlas::Float, filter, TableKind::Direct);
        let text = |fade| wgsl(&Kinds::of(kind, FeedbackMode::Separate, fade), BindingPlace::default());
        let knows = |text: &str| text.contains("vastexi_fades") || text.contains("VASTEXI_BINDING_FADES");
        assert!(knows(&text(true)) && !knows(&text(false)), "{filter}");
        assert!(!text(false).contains("vastexi_old_share"), "{filter}");
    }
}

#[test]
fn feedback_is_the_same_whether_tiles_fade_or_not() {
    for module in [FEEDBACK, NAMES_FEEDBACK, LEVELS, PAGE, VIEW, REPORT, TEXTURE_SPACE] {
        assert!(!module.contains("vastexi_shown") && !module.contains("vastexi_filtered"));
    }
}

#[test]
fn every_shader_of_our_own_is_valid() {
    assert_eq!(module(&pool_tables_wgsl()).entry_points.len(), 4);
    assert_eq!(module(&compact_wgsl()).entry_points.len(), 2);
    assert_eq!(module(&inline_wgsl()).entry_points.len(), 2);
}
