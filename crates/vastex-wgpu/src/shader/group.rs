//! Shader text for a group: the modules of one texture once for each member, with the member's name in their names.
//!
//! In `vastex_sample_grad` the name follows the first word: `vastex_sample_color_grad`. What members share, structs and the
//! functions that know of no texture, is there once. The modules say `vastex_texture`, `vastex_pool` and `vastex_table`; of a member
//! these are places in what the group binds.

use std::collections::BTreeSet;

use super::{
    Atlas, CUBIC, FEEDBACK, FEEDBACK_FIXED, FOOTPRINT, Filter, HASHED, INSPECT, INSPECTION, LAMBDA, LEVEL,
    LOOKUP, PAGE, PARAMS, POSITION, PageSides, SAMPLE, SAMPLE_FIXED, TELL, TableKinds, VIEW, atlas_modules,
    constants, fades_binding, filter_modules, push_constant, push_filter, table_binding, table_module,
    tell_modules,
};
use crate::error::GpuError;
use crate::way::FeedbackWay;

/// Bindings of a group; page tables and atlases follow.
pub(crate) const PARAMS_BINDING: u32 = 0;
pub(crate) const VIEW_BINDING: u32 = 1;
pub(crate) const SAMPLER_BINDING: u32 = 2;
const FIRST_TABLE: u32 = 3;

/// A member of a group, as shaders see it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupMember {
    /// Its name in the names of functions: lower-case letters, digits and underscores, a letter first.
    pub name: String,
    /// Which of the group's textures it is a layer of, counted from 0.
    pub texture: usize,
    /// How its atlas is read.
    pub atlas: Atlas,
    /// Which kind of page table its texture has.
    pub tables: TableKinds,
    /// What is known of its texture's pages.
    pub pages: PageSides,
    /// How its texels are blended, where that is not the group's filter.
    pub filter: Option<Filter>,
    /// Whether its tiles fade in where the group's do; those of a layer whose values may not be mixed do not.
    pub fades: bool,
}

/// What the text and the bind group of a group are made for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupShape {
    members: Vec<GroupMember>,
    textures: usize,
    has_feedback: bool,
    fade: bool,
}

impl GroupShape {
    /// Members in the order in which they are bound; where `has_feedback`, `vastex_feedback(uv)` answers for them together.
    ///
    /// Fails where a name cannot stand in WGSL, or would make two functions of one name.
    pub fn new(members: Vec<GroupMember>, has_feedback: bool) -> Result<GroupShape, GpuError> {
        let refuse = |member: &GroupMember, why| GpuError::MemberName { name: member.name.clone(), why };
        let mut taken: BTreeSet<String> =
            names(&SHARED_MODULES).into_iter().chain(names(&[TELL])).map(String::from).collect();
        if has_feedback {
            taken.extend(names(&SHAPE_MODULES).into_iter().map(String::from));
        }
        for member in &members {
            let is_letter = |c: char| c.is_ascii_lowercase();
            let is_fit = |c: char| is_letter(c) || c.is_ascii_digit() || c == '_';
            if !member.name.starts_with(is_letter) || !member.name.chars().all(is_fit) {
                let why = "it must be lower-case letters, digits and underscores, a letter first";
                return Err(refuse(member, why));
            }
            // Whatever the filter that the text will be made for, and whether tiles fade in; ways of feedback differ in no name.
            let of = |filter| member_modules(member.atlas, filter, FeedbackWay::Separate, true);
            let modules: Vec<_> = Filter::KINDS.into_iter().flat_map(of).collect();
            if names(&modules).iter().any(|name| !taken.insert(with_member(name, &member.name))) {
                return Err(refuse(member, "it makes two functions of one name; choose another"));
            }
        }
        let textures = members.iter().map(|member| member.texture + 1).max().unwrap_or(0);
        Ok(GroupShape { members, textures, has_feedback, fade: false })
    }

    /// The same where tiles fade in, or do not, as they do not unless it is said: [`crate::ShaderOptions::fade`].
    pub fn with_fade(self, fade: bool) -> GroupShape {
        GroupShape { fade, ..self }
    }

    /// Whether tiles fade in.
    pub fn fade(&self) -> bool {
        self.fade
    }

    /// The members.
    pub fn members(&self) -> &[GroupMember] {
        &self.members
    }

    /// Textures that they are layers of.
    pub fn textures(&self) -> usize {
        self.textures
    }

    pub(crate) fn table_binding(&self, texture: usize) -> u32 {
        FIRST_TABLE + texture as u32
    }

    pub(crate) fn atlas_binding(&self, member: usize) -> u32 {
        FIRST_TABLE + (self.textures + member) as u32
    }

    /// Of the pool of a texture, one for all its layers; where tiles fade in.
    pub(crate) fn fades_binding(&self, texture: usize) -> u32 {
        self.atlas_binding(self.members.len() + texture)
    }

    pub(crate) fn cells_binding(&self) -> u32 {
        self.atlas_binding(self.members.len() + if self.fade { self.textures } else { 0 })
    }
}

/// The modules that know of no texture.
const SHARED_MODULES: [&str; 5] = [LAMBDA, POSITION, CUBIC, VIEW, INSPECTION];

/// The modules of the group's shape, which feedback of the whole group names pages of.
const SHAPE_MODULES: [&str; 5] = [FOOTPRINT, LEVEL, PAGE, FEEDBACK, FEEDBACK_FIXED];

fn member_modules(atlas: Atlas, filter: Filter, way: FeedbackWay, fade: bool) -> Vec<&'static str> {
    let (lookup, sample) = ([table_module(way), HASHED, LOOKUP], [SAMPLE, SAMPLE_FIXED, INSPECT]);
    [&SHAPE_MODULES[..], &lookup, atlas_modules(atlas), &filter_modules(filter, fade), &sample].concat()
}

/// The WGSL that an application puts after its own shader that samples a group, as [`crate::wgsl()`] is put; the bind group's index as in
/// [`crate::ShaderOptions`].
///
/// For each member `NAME` it has the functions of [`crate::wgsl()`] with the name after the first word: `vastex_sample_NAME(uv)`,
/// `vastex_sample_NAME_wrapped(uv)`, `vastex_sample_NAME_grad(uv, ddx, ddy)`, `vastex_sample_NAME_level(uv, level)`, and `vastex_feedback_NAME(uv)` and its kin for a
/// member by itself; those in fixed point are `vastex_sample_NAME_fixed(anchor, offset)` and its kin, in texels of that member;
/// `vastex_inspect_NAME(uv)` and `vastex_inspect_NAME_grad(uv, ddx, ddy)` tell what it is sampled by. For all together there are
///
/// | function | stages | gives |
/// |---|---|---|
/// | `vastex_feedback(uv)`, `_wrapped`, `_grad`, `_level` | as of one texture | a feedback pixel that serves every member that is sampled at `uv` |
/// | `vastex_feedback_fixed(anchor, offset)`, `_grad`, `_level` | as of one texture | the same, in texels of the member with the most |
/// | `vastex_tell(position, wanted)`, `vastex_asked(position)` | fragment, main pass | as of one texture |
/// | `vastex_keeps(position, opacity)`, `vastex_gradients(position, uv)` | fragment | as of one texture |
/// | `vastex_feedback_clip(clip)` | vertex, feedback pass only | the clip position in the feedback target |
/// | `vastex_turn(position, count)` | fragment | which of `count` answers this pixel gives in this frame |
///
/// `vastex_feedback_level(uv, level)` takes levels of the member with the most texels. `position` is `@builtin(position)`. Texels are
/// blended by `filter`, but for members with [one of their own](GroupMember::filter); feedback for all together asks for the level that
/// the filter with the most taps among theirs needs, which is the finest.
pub fn group_wgsl(group: u32, filter: Filter, feedback: FeedbackWay, shape: &GroupShape) -> String {
    let mut text = constants();
    push_constant(&mut text, "GROUP", group);
    let filter_of = |member: &GroupMember| member.filter.unwrap_or(filter);
    let finest = shape.members.iter().map(filter_of).max_by_key(|filter| filter.max_taps());
    push_filter(&mut text, finest.unwrap_or(filter));
    text += &bindings(shape, feedback);
    for &module in [PARAMS].iter().chain(&SHARED_MODULES).chain(tell_modules(feedback)) {
        text += "\n";
        text += &module.replace("VASTEX_BINDING_CELLS", &shape.cells_binding().to_string());
    }
    if shape.has_feedback {
        let of_shape = |word: &str| match word {
            "vastex_texture" => Some("vastex_group.textures[0]".to_owned()),
            "VASTEX_PAGES" => Some(format!("{}u", PageSides::Any.code())),
            _ => None,
        };
        SHAPE_MODULES.iter().for_each(|module| push_renamed(&mut text, module, of_shape));
    }
    for (nth, member) in shape.members.iter().enumerate() {
        let filter = filter_of(member);
        let modules = member_modules(member.atlas, filter, feedback, shape.fade && member.fades);
        let own = names(&modules);
        let renamed = |word: &str| match word {
            "vastex_texture" => Some(format!("vastex_group.textures[{}]", member.texture + 1)),
            "vastex_pool" => Some(format!("vastex_group.pools[{nth}]")),
            "vastex_table" => Some(format!("vastex_table_{}", member.texture)),
            "vastex_fades" => Some(format!("vastex_fades_{}", member.texture)),
            "VASTEX_TABLES" => Some(format!("{}u", member.tables.code())),
            "VASTEX_PAGES" => Some(format!("{}u", member.pages.code())),
            "VASTEX_FILTER" => Some(format!("{}u", filter.code())),
            "VASTEX_MAX_TAPS" => Some(format!("{}u", filter.max_taps())),
            "VASTEX_BINDING_ATLAS" => Some(shape.atlas_binding(nth).to_string()),
            _ => own.contains(word).then(|| with_member(word, &member.name)),
        };
        modules.iter().for_each(|module| push_renamed(&mut text, module, renamed));
    }
    text
}

/// What the group binds, but for the atlases, which stand with the functions that read them. The shape's parameters come first
/// among the textures'.
fn bindings(shape: &GroupShape, way: FeedbackWay) -> String {
    let (textures, pools) = (shape.textures + 1, shape.members.len());
    let bound = |binding: u32, what: &str| format!("@group(VASTEX_GROUP) @binding({binding}) var{what};\n");
    let mut text = format!(
        "\n// The bind group of a group.\n\nstruct VastexGroup {{\n    textures: array<VastexTexture, {textures}>,\n    \
         pools: array<VastexPool, {pools}>,\n}}\n\n"
    );
    text += &bound(PARAMS_BINDING, "<uniform> vastex_group: VastexGroup");
    text += &bound(VIEW_BINDING, "<uniform> vastex_view: VastexView");
    text += &bound(SAMPLER_BINDING, " vastex_sampler: sampler");
    for texture in 0..shape.textures {
        text += &table_binding(shape.table_binding(texture), &format!("vastex_table_{texture}"), way);
        if shape.fade {
            text += &fades_binding(shape.fades_binding(texture), &format!("vastex_fades_{texture}"));
        }
    }
    text
}

/// The names that modules give to functions and to what they bind.
fn names(modules: &[&'static str]) -> BTreeSet<&'static str> {
    let declared = |line: &'static str| {
        let bound = || Some(line.strip_prefix('@')?.split_once(" var ")?.1);
        let rest = line.strip_prefix("fn ").or_else(bound)?;
        rest.split(|c: char| !is_of_word(c)).next()
    };
    modules.iter().flat_map(|module| module.lines().filter_map(declared)).collect()
}

/// `vastex_sample_grad` with `color` is `vastex_sample_color_grad`.
fn with_member(word: &str, member: &str) -> String {
    let after_prefix = word.find('_').map_or(0, |at| at + 1);
    let first = word[after_prefix..].find('_').map_or(word.len(), |at| after_prefix + at);
    format!("{}_{member}{}", &word[..first], &word[first..])
}

fn push_renamed(text: &mut String, module: &str, renamed: impl Fn(&str) -> Option<String>) {
    text.push('\n');
    let mut rest = module;
    while let Some(first) = rest.find(is_of_word) {
        let (before, from_word) = rest.split_at(first);
        let end = from_word.find(|c| !is_of_word(c)).unwrap_or(from_word.len());
        let (word, after) = from_word.split_at(end);
        text.push_str(before);
        text.push_str(&renamed(word).unwrap_or_else(|| word.to_owned()));
        rest = after;
    }
    text.push_str(rest);
}

fn is_of_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::tests::module;

    fn member(name: &str, texture: usize, atlas: Atlas) -> GroupMember {
        GroupMember {
            name: name.to_owned(),
            texture,
            atlas,
            tables: TableKinds::Either,
            pages: PageSides::Any,
            filter: None,
            fades: true,
        }
    }

    /// A color and a height of one texture, a night of another.
    fn planet(atlas: Atlas) -> GroupShape {
        let members = vec![
            member("color", 0, Atlas::Float),
            member("height", 0, atlas),
            member("night_2", 1, Atlas::Float),
        ];
        GroupShape::new(members, true).unwrap()
    }

    /// An application that calls the whole public surface of that group.
    fn application() -> String {
        let mut sampled = String::new();
        for name in ["color", "height", "night_2"] {
            sampled += &format!(
                "+ vastex_sample_{name}(at.xy) + vastex_sample_{name}_grad(at.xy, at.yx, at.zw) + vastex_sample_{name}_level(at.xy, 1.0)
                + vastex_sample_{name}_fixed(vec2<u32>(9u), at.xy) + vastex_sample_{name}_fixed_level(vec2<u32>(9u), at.xy, 2.0)"
            );
        }
        format!(
            "@vertex fn vertex(@location(0) at: vec4<f32>) -> @builtin(position) vec4<f32> {{
                return vastex_feedback_clip(at) + vastex_sample_height_level(at.xy, 1.0);
            }}
            @fragment fn main_pass(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {{
                vastex_tell(at, vastex_feedback(at.xy));
                let inspected = vastex_inspect_color(at.xy);
                return at {sampled} + vastex_inspect_night_2_grad(at.xy, at.yx, at.zw).level * inspected.page_texel.xyxy;
            }}
            @fragment fn feedback_pass(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {{
                return vastex_feedback(at.xy) + vastex_feedback_grad(at.xy, at.yx, at.zw)
                    + vastex_feedback_level(at.xy, 1.0) + vastex_feedback_fixed(vec2<u32>(9u), at.xy);
            }}
            @fragment fn by_turns(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32> {{
                let wanted = array(vastex_feedback_color(at.xy), vastex_feedback_night_2_grad(at.yx, at.xy, at.zw));
                return wanted[vastex_turn(at, 2u)] + vastex_feedback_height_level(at.xy, 0.0)
                    + vastex_feedback_height_fixed_grad(vec2<u32>(9u), at.xy, at.yx, at.zw);
            }}"
        )
    }

    /// The bindings of bind group 2, in order.
    fn bound(text: &str) -> Vec<u32> {
        let module = module(text);
        let bindings = module.global_variables.iter().filter_map(|(_, v)| v.binding.as_ref());
        let mut bound: Vec<u32> = bindings.filter(|b| b.group == 2).map(|b| b.binding).collect();
        bound.sort_unstable();
        bound
    }

    #[test]
    fn every_variant_of_the_text_for_groups_is_valid() {
        for filter in Filter::KINDS {
            for atlas in Atlas::ALL {
                let text =
                    |way, fade| application() + &group_wgsl(2, filter, way, &planet(atlas).with_fade(fade));
                module(&text(FeedbackWay::Inline, false));
                module(&text(FeedbackWay::Raw, true));
                // Parameters, view, sampler, two tables, three atlases; the fades of two pools; and where pixels tell.
                assert_eq!(bound(&text(FeedbackWay::Separate, false)), (0..8).collect::<Vec<_>>());
                assert_eq!(bound(&text(FeedbackWay::Separate, true)), (0..10).collect::<Vec<_>>());
                assert_eq!(bound(&text(FeedbackWay::Inline, true)), (0..11).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn a_member_that_may_not_be_mixed_is_read_nearest_by_a_text_that_knows_no_fading() {
        let labels =
            GroupMember { filter: Some(Filter::Nearest), fades: false, ..member("label", 0, Atlas::Float) };
        let members = vec![member("color", 0, Atlas::Float), labels];
        for filter in Filter::KINDS {
            let shape = GroupShape::new(members.clone(), true).unwrap().with_fade(true);
            let text = group_wgsl(0, filter, FeedbackWay::Separate, &shape);
            module(&text);
            // The body of a function, as far as the next line that is a brace alone.
            let body = |name: &str| {
                let (_, from) = text.split_once(&format!("fn {name}(")).unwrap();
                from.split_once("\n}").unwrap().0.to_owned()
            };
            let taps = |name: &str| body(name).contains(&format!("{}u == 1u", filter.max_taps()));
            assert!(taps("vastex_footprint_color"), "{filter}");
            assert!(body("vastex_footprint_label").contains("if 1u == 1u"), "{filter}");
            // What is asked for together is what the finest needs.
            assert!(text.contains(&format!("const VASTEX_MAX_TAPS: u32 = {}u;", filter.max_taps())));
            assert!(body("vastex_taken_label").contains("vastex_atlas_label_nearest(place)"), "{filter}");
            assert!(body("vastex_shown_color").contains("vastex_old_color_share"), "{filter}");
            assert!(!text.contains("vastex_old_label_share"), "{filter}");
        }
    }

    #[test]
    fn without_feedback_of_its_own_a_group_has_that_of_its_members() {
        let shape =
            GroupShape::new(vec![member("a", 0, Atlas::Float), member("b", 1, Atlas::Float)], false).unwrap();
        let text = group_wgsl(0, Filter::Trilinear, FeedbackWay::Separate, &shape);
        module(&text);
        assert!(!text.contains("fn vastex_feedback(") && text.contains("fn vastex_feedback_a("));
    }

    #[test]
    fn the_name_follows_the_first_word() {
        assert_eq!(with_member("vastex_sample", "color"), "vastex_sample_color");
        assert_eq!(with_member("vastex_sample_grad", "color"), "vastex_sample_color_grad");
        let modules = |atlas| member_modules(atlas, Filter::Bicubic, FeedbackWay::Raw, false);
        assert!(names(&modules(Atlas::Uint16)).contains("vastex_atlas_texel"));
        assert!(names(&modules(Atlas::Float)).contains("vastex_atlas"));
    }

    /// What `names` takes line by line from the modules is all that naga finds declared in them.
    #[test]
    fn all_functions_and_bindings_of_a_member_have_its_name() {
        for filter in Filter::KINDS {
            for atlas in Atlas::ALL {
                for way in FeedbackWay::ALL {
                    for fade in [false, true] {
                        let options =
                            crate::ShaderOptions { filter, atlas, feedback: way, fade, ..Default::default() };
                        let module = module(&crate::wgsl(&options));
                        let functions =
                            module.functions.iter().filter_map(|(_, function)| function.name.clone());
                        let globals =
                            module.global_variables.iter().filter_map(|(_, global)| global.name.clone());
                        let declared: BTreeSet<String> = functions.chain(globals).collect();
                        let mut known: BTreeSet<String> = names(&member_modules(atlas, filter, way, fade))
                            .into_iter()
                            .map(String::from)
                            .collect();
                        known.extend(names(&SHARED_MODULES).into_iter().map(String::from));
                        known.extend(names(tell_modules(way)).into_iter().map(String::from));
                        // What is bound at places that a group numbers, or once for all members.
                        let bound = [
                            "vastex_texture",
                            "vastex_pool",
                            "vastex_view",
                            "vastex_sampler",
                            "vastex_table",
                            "vastex_fades",
                            "vastex_cells",
                        ];
                        known.extend(bound.map(String::from));
                        // Texture space is one texture's, and no group's.
                        let unknown: Vec<&String> = declared
                            .difference(&known)
                            .filter(|name| !name.starts_with("vastex_texture_space"))
                            .collect();
                        assert!(unknown.is_empty(), "{filter} {atlas:?} {way:?}: {unknown:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn names_that_would_not_do_are_refused() {
        let with = |names: &[&str], has_feedback| {
            let members = names.iter().map(|name| member(name, 0, Atlas::Float)).collect();
            GroupShape::new(members, has_feedback)
        };
        for bad in ["", "Color", "2nd", "_x", "a b", "farbe\u{e4}", "a;b"] {
            assert!(
                matches!(with(&[bad], true), Err(GpuError::MemberName { name, .. }) if name == bad),
                "{bad}"
            );
        }
        // vastex_feedback_grad is the group's; vastex_sample_a_grad both the first's and the second's.
        for clash in [&["grad"][..], &["a", "a_grad"], &["a", "b", "a"]] {
            let error = with(clash, true).unwrap_err().to_string();
            assert!(error.contains("choose another"), "{error}");
        }
        assert!(with(&["grad"], false).is_ok());
    }
}
