//! The first minutes of a newcomer: `cargo xtask demo` compiles what it runs and nothing else.

use std::collections::BTreeSet;

use anyhow::{Result, ensure};

use crate::tree;

#[path = "../../src/demo_program.rs"]
mod demo_program;

/// The crates that the demo compiles on Linux: all of them without a display, then those that a window adds.
const KEPT: &str = include_str!("demo_crates.txt");

fn compiled(window: bool) -> Result<BTreeSet<String>> {
    let target = ["-p", "vastex-cli", "--target", "x86_64-unknown-linux-gnu"];
    tree::crates(&[&target[..], &demo_program::features(window)].concat())
}

#[test]
fn the_demo_compiles_the_crates_that_are_kept_here() -> Result<()> {
    let (program, window) = KEPT.split_once("\n\n").unwrap_or((KEPT, ""));
    let kept = |lists: &[&str]| -> BTreeSet<String> {
        let lines = lists.iter().flat_map(|list| list.lines());
        lines
            .filter(|line| !line.starts_with('#'))
            .flat_map(str::split_whitespace)
            .map(str::to_owned)
            .collect()
    };
    for (kept, has_window) in [(kept(&[program]), false), (kept(&[program, window]), true)] {
        let compiled = compiled(has_window)?;
        let new: Vec<_> = compiled.difference(&kept).collect();
        ensure!(
            new.is_empty(),
            "the demo compiles {new:?} as well (with a window: {has_window}), and everybody who looks at this project for the first \
             time waits for it: put them behind a feature that the demo leaves out, or write them into demo_crates.txt"
        );
        let gone: Vec<_> = kept.difference(&compiled).collect();
        ensure!(gone.is_empty(), "the demo compiles {gone:?} no longer: take them out of demo_crates.txt");
    }
    Ok(())
}
