//! No function of the text for applications goes untested: each is reached from a shader by which these tests compare it with its twin, or with
//! what it must give.

use std::collections::BTreeSet;

use naga::compact::{KeepUnused, compact};
use vastex_wgpu::{Atlas, FeedbackWay, Filter, ShaderOptions, wgsl};

use crate::{exact, feedback, fixed, inspect, sampling, seams, stages, texture_space, ways};

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
    ways::SURFACES,
];
/// What pictures of the pool call, which `apps/scenes` looks at.
const ELSEWHERE: [&str; 1] = ["vastex_inspect_slot"];

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
        let feedback = [FeedbackWay::Separate, FeedbackWay::Inline, FeedbackWay::Raw][nth % 3];
        let options = ShaderOptions { filter, atlas, feedback, fade: nth % 2 == 1, ..Default::default() };
        let text = wgsl(&options);
        declared.extend(functions(&text, KeepUnused::Yes));
        for shader in SHADERS {
            let text = format!("{shader}\nconst SIDE: u32 = 64u;\n{text}");
            reached.extend(functions(&text, KeepUnused::No));
        }
    }
    reached.extend(ELSEWHERE.map(str::to_owned));
    assert!(declared.len() > 60, "{declared:?}");
    let missed: Vec<_> = declared.difference(&reached).collect();
    assert!(missed.is_empty(), "no test's shader reaches {missed:?}");
}
