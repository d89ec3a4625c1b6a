//! `cargo xtask times`: the processor time of tests, each run by itself, so that it can be seen which of them
//! is worth being made cheaper. Nothing fails for its time.
//!
//! A test that is run alone makes a device and pipelines of its own, which tests of one program share: sums
//! are upper bounds of what the suite takes.

use std::time::Duration;

use anyhow::{Result, bail};
use xtask::limited::within;

use crate::outcome::{Outcome, SEED};
use crate::shell::{self, Usage};
use crate::{test_programs, window};

/// Stands for the tests of the viewer of images and planets, in place of words of their names.
const VIEWER: &str = "viewer";
/// What those are: packages, and how the names of their tests begin. The window is used besides.
const OF_VIEWER: &[(&str, &[&str])] = &[
    ("crates/vastex-viewer", &["eframe_example::", "surface_scene::", "widget::", "window_scene::"]),
    (
        "apps/vastex-cli",
        &[
            "bands::",
            "cache::",
            "camera::",
            "first_range::",
            "heights::",
            "in_place::",
            "links::",
            "out::",
            "parts::",
            "places::",
            "planet::",
        ],
    ),
    (
        "crates/vastex-build",
        &["coarse_jpeg::", "memory_image::", "pyramids::", "readers::", "sparse_tiff::", "streamed_tiff::"],
    ),
    ("crates/vastex-tiles", &["sources::image::"]),
];

/// Tests whose names contain one of the words, or those of the viewer, or all.
pub(crate) fn run(words: &[&str]) -> Result<()> {
    if let Some(option) = words.iter().find(|word| word.starts_with('-')) {
        return Err(Usage(format!("times takes words of names of tests, not '{option}'")).into());
    }
    let is_of_viewer = matches!(words, [VIEWER]);
    let (mut rows, mut failed) = (Vec::new(), Vec::new());
    for program in test_programs::compiled()? {
        let package = program.of().display().to_string();
        for test in program.tests()? {
            let is_asked_for = match is_of_viewer {
                true => belongs_to_viewer(&package, &test),
                false => words.is_empty() || words.iter().any(|word| test.contains(word)),
            };
            if !is_asked_for {
                continue;
            }
            let before = shell::processor_time();
            let ended = within(program.alone(&test).env("PROPTEST_RNG_SEED", SEED), test_programs::LIMIT)?;
            let Some((before, after)) = before.zip(shell::processor_time()) else {
                bail!("this system does not say how much processor time programs have taken");
            };
            let name = format!("{package} {test}");
            if !ended.status.success() {
                failed.push(name.clone());
            }
            rows.push((after.saturating_sub(before), name));
        }
    }
    if is_of_viewer {
        let before = shell::processor_time().unwrap_or_default();
        if matches!(window::check()?, Outcome::Passed) {
            let taken = shell::processor_time().unwrap_or_default().saturating_sub(before);
            rows.push((taken, "the window".to_owned()));
        }
    }
    rows.sort();
    for (taken, name) in rows.iter().rev() {
        println!("{:>8.2} s  {name}", taken.as_secs_f64());
    }
    let all: Duration = rows.iter().map(|(taken, _)| *taken).sum();
    println!("{:>8.2} s  of a processor, all {}", all.as_secs_f64(), rows.len());
    match &*failed {
        [] => Ok(()),
        failed => bail!("failed: {}", failed.join(", ")),
    }
}

fn belongs_to_viewer(package: &str, test: &str) -> bool {
    let of_package = OF_VIEWER.iter().filter(|(known, _)| *known == package);
    of_package.flat_map(|(_, tests)| *tests).any(|begin| test.starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tests_of_the_viewer_are_there() {
        for (package, tests) in OF_VIEWER {
            let folders =
                ["tests/suite", "tests/program", "src"].map(|f| shell::root().join(package).join(f));
            for begin in *tests {
                let module = begin.trim_end_matches("::").replace("::", "/");
                let is_there = |folder: &std::path::PathBuf| {
                    folder.join(&module).is_dir() || folder.join(format!("{module}.rs")).is_file()
                };
                assert!(folders.iter().any(is_there), "{package} has no {module}");
            }
        }
        assert!(belongs_to_viewer("apps/vastex-cli", "cache::an_image"));
        assert!(!belongs_to_viewer("crates/vastex-build", "cache::an_image"));
    }
}
