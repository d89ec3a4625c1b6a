//! Names of a group's members in the names of functions: `vastex_sample_grad` with `color` is
//! `vastex_sample_color_grad`; and the modules with functions that an application calls, whose names no
//! member may make again.

use std::collections::BTreeSet;

use crate::error::GpuError;

pub(crate) const RECORDS: &str = include_str!("wgsl/records.wgsl");
pub(crate) const VIEW: &str = include_str!("wgsl/view.wgsl");
pub(crate) const REPORT: &str = include_str!("wgsl/report.wgsl");
pub(crate) const TEXTURE_SPACE: &str = include_str!("wgsl/texture_space.wgsl");
pub(crate) const NAMES_SAMPLE: &str = include_str!("wgsl/names_sample.wgsl");
pub(crate) const NAMES_FEEDBACK: &str = include_str!("wgsl/names_feedback.wgsl");
pub(crate) const VOLUME_RECORDS: &str = include_str!("wgsl/volume_records.wgsl");
pub(crate) const BRICK: &str = include_str!("wgsl/brick.wgsl");
pub(crate) const NAMES_BRICK: &str = include_str!("wgsl/names_brick.wgsl");
pub(crate) const NAMES_BRICK_VALUES: &str = include_str!("wgsl/names_brick_values.wgsl");
pub(crate) const NAMES_BRICK_BLENDED: &str = include_str!("wgsl/names_brick_blended.wgsl");
pub(crate) const NAMES_BRICK_UNBLENDED: &str = include_str!("wgsl/names_brick_unblended.wgsl");
pub(crate) const NAMES_BRICK_WHOLE: &str = include_str!("wgsl/names_brick_whole.wgsl");
pub(crate) const NAMES_BRICK_FEEDBACK: &str = include_str!("wgsl/names_brick_feedback.wgsl");

/// Words that WGSL keeps to itself, as far as they could be a member's name; so no field of a struct can be
/// called so.
const RESERVED: &str = "alias alignas alignof array async attribute auto await become break case cast catch class column_major common \
    compile compile_fragment concept const const_assert const_cast consteval constexpr constinit continue continuing crate debugger \
    decltype default delete demote demote_to_helper diagnostic discard do dynamic_cast else enable enum explicit export extends extern \
    external fallthrough false filter final finally fn for friend from fxgroup get goto groupshared highp if impl implements import \
    inline instanceof interface layout let loop lowp macro macro_rules match mediump meta mod module move mut mutable namespace new nil \
    noexcept noinline nointerpolation non_coherent noncoherent noperspective null nullptr of operator override package packoffset \
    params pass patch pixelfragment precise precision premerge priv private protected pub public readonly ref regardless register \
    reinterpret_cast require requires resource restrict return self set shared sizeof smooth snorm static static_assert static_cast std \
    struct subroutine super switch target template this thread_local throw trait true try type typedef typeid typename typeof union \
    unless unorm unsafe unsized use using var varying virtual volatile wgsl where while with writeonly yield";

/// What ids of the whole group are called.
const ALL: &str = "all";

/// Fails where a name cannot stand in WGSL, or would make two functions of one name.
pub(crate) fn check_names<'a>(members: impl Iterator<Item = &'a str>) -> Result<(), GpuError> {
    let refuse = |name: &str, why| Err(GpuError::MemberName { name: name.to_owned(), why });
    let shared = [RECORDS, VIEW, REPORT, TEXTURE_SPACE, VOLUME_RECORDS, BRICK]
        .into_iter()
        .flat_map(functions)
        .map(str::to_owned);
    let of_all = [NAMES_FEEDBACK, NAMES_BRICK_FEEDBACK].into_iter().flat_map(functions);
    let of_all = of_all.map(|function| named(function, None));
    let mut taken: BTreeSet<String> = shared.chain(of_all).collect();
    for name in members {
        let is_letter = |c: char| c.is_ascii_lowercase();
        let is_fit = |c: char| is_letter(c) || c.is_ascii_digit() || c == '_';
        if !name.starts_with(is_letter) || !name.chars().all(is_fit) {
            return refuse(name, "it must be lower-case letters, digits and underscores, a letter first");
        }
        if name == ALL {
            return refuse(name, "that is the group as a whole; choose another");
        }
        let of_image = [NAMES_SAMPLE, NAMES_FEEDBACK];
        let of_volume = [NAMES_BRICK, NAMES_BRICK_VALUES, NAMES_BRICK_BLENDED, NAMES_BRICK_FEEDBACK];
        let of_labels = [NAMES_BRICK_WHOLE];
        let of_member = of_image.into_iter().chain(of_volume).chain(of_labels).flat_map(functions);
        if of_member.map(|function| named(function, Some(name))).any(|function| !taken.insert(function)) {
            return refuse(name, "it makes two functions of one name; choose another");
        }
    }
    Ok(())
}

/// The struct of a group's ids, in the order in which an application is given them.
pub(crate) fn ids_struct<'a>(members: impl Iterator<Item = &'a str>) -> String {
    let is_reserved = |name: &str| RESERVED.split_whitespace().any(|word| word == name);
    let field = |name: &str| format!("    {name}{}: u32,\n", if is_reserved(name) { "_" } else { "" });
    let fields: String = std::iter::once(ALL).chain(members).map(field).collect();
    format!(
        "// The ids of a group; where a member's name is a word of WGSL, with an underscore behind.\n\
         struct VastexIds {{\n{fields}}}\n"
    )
}

/// A module with a name in the place of `NAME`, or none.
pub(crate) fn named(text: &str, name: Option<&str>) -> String {
    match name {
        Some(name) => text.replace("NAME", name),
        None => text.replace("_NAME", ""),
    }
}

/// The names of a module's functions.
fn functions(module: &str) -> impl Iterator<Item = &str> {
    module.lines().filter_map(|line| line.strip_prefix("fn ")?.split('(').next())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(names: &[&str]) -> Result<(), GpuError> {
        check_names(names.iter().copied())
    }

    #[test]
    fn names_that_would_not_do_are_refused() {
        for bad in ["", "Color", "2nd", "_x", "a b", "farbe\u{e4}", "a;b", "all"] {
            assert!(matches!(check(&[bad]), Err(GpuError::MemberName { name, .. }) if name == bad), "{bad}");
        }
        // vastex_feedback_grad is the group's; vastex_sample_a_grad both the first's and the second's.
        for clash in [&["grad"][..], &["a", "a_grad"], &["a", "b", "a"], &["a", "a_nearest"]] {
            let error = check(clash).unwrap_err().to_string();
            assert!(error.contains("choose another"), "{error}");
        }
        assert!(check(&["color", "height", "night_2"]).is_ok());
    }

    #[test]
    fn the_name_follows_the_first_words() {
        assert_eq!(named("vastex_sample_NAME_grad", Some("color")), "vastex_sample_color_grad");
        assert_eq!(named("vastex_sample_NAME_grad", None), "vastex_sample_grad");
        assert!(functions(NAMES_SAMPLE).count() > 10 && functions(NAMES_FEEDBACK).count() > 8);
        assert!(functions(NAMES_SAMPLE).chain(functions(NAMES_FEEDBACK)).all(|name| name.contains("_NAME")));
    }

    #[test]
    fn fields_of_ids_are_no_words_of_the_language() {
        let text = ids_struct(["color", "class", "mask"].into_iter());
        assert!(text.contains("all: u32") && text.contains("class_: u32") && text.contains(" mask: u32"));
        assert!(naga::front::wgsl::parse_str(&text).is_ok());
    }
}
