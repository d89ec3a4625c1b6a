//! No function of the text for applications goes untested: each is reached from a shader by which these tests
//! compare it with its twin, or with what it must give.

use std::collections::BTreeSet;

use naga::compact::{KeepUnused, compact};
use vastex_wgpu::{Atlas, BindingPlace, FeedbackMode, Filter, Kind, Kinds, PageSides, TableKind, wgsl};

use crate::{exact, feedback, fixed, inspect, modes, sampling, seams, stages, texture_space};

/// The shaders, each of a test of its own.
const SHADERS: [&str; 11] = [
    sampling::HARNESS,
    fixed::HARNESS,
    fixed::FOLDING,
    exact::HARNESS,
    stages::POINTS,
    stages::GROUND,
    seams::DISC,
    feedback::PLANE,
    inspect::HARNESS,
    texture_space::SHADER,
    modes::SURFACES,
];
/// What pictures of the pool, overlays in fixed point and reliefs call, which the tests of `apps/scenes` look
/// at; and what only joins its derivatives to `vastex_sample_nearest_grad`.
const ELSEWHERE: [&str; 6] = [
    "vastex_inspect_fixed_grad",
    "vastex_inspect_slot",
    "vastex_inspect_slot_size",
    "vastex_level_of",
    "vastex_pixel_scale",
    "vastex_sample_nearest",
];

/// Names of the functions that a text declares, or of those that its entry points reach.
fn functions(text: &str, keep_unused: KeepUnused) -> BTreeSet<String> {
    let mut module = naga::front::wgsl::parse_str(text).unwrap();
    if matches!(keep_unused, KeepUnused::No) {
        compact(&mut module, keep_unused);
    }
    module.functions.iter().filter_map(|(_, function)| function.name.clone()).collect()
}

#[test]
fn every_function_is_reached_by_a_test() {
    let (mut declared, mut reached) = (BTreeSet::new(), BTreeSet::new());
    let variants = Filter::KINDS.into_iter().flat_map(|filter| Atlas::ALL.map(|atlas| (filter, atlas)));
    for (nth, (filter, atlas)) in variants.enumerate() {
        let feedback = [FeedbackMode::Separate, FeedbackMode::Inline, FeedbackMode::Raw][nth % 3];
        let tables = [TableKind::Direct, TableKind::Hashed][nth % 2];
        let (dims, pages) = (vastex_core::Dims::D2, PageSides::Any);
        let kind = Kind { dims, tables, pages, layer: 0, atlas, scale: 1, filter, is_mixed: true };
        let text = wgsl(&Kinds::of(kind, feedback, nth % 3 == 1), BindingPlace::default());
        declared.extend(functions(&text, KeepUnused::Yes));
        let nearest = sampling::nearest_harness();
        for shader in SHADERS.into_iter().chain([nearest.as_str()]) {
            let text = format!(
                "{shader}\nconst SIDE: u32 = 64u;\nconst ID: u32 = 1u;\nconst VIEW: u32 = 0u;\n{text}"
            );
            reached.extend(functions(&text, KeepUnused::No));
        }
    }
    reached.extend(ELSEWHERE.map(str::to_owned));
    assert!(declared.len() > 60, "{declared:?}");
    let missed: Vec<_> = declared.difference(&reached).collect();
    assert!(missed.is_empty(), "no test's shader reaches {missed:?}");
}
