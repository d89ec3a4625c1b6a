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
use crate::{setup, test_programs, window};

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
    if shell::processor_time().is_none() {
        bail!("this system does not say how much processor time programs have taken");
    }
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    let mut times = Times::default();
    for program in test_programs::compiled()? {
        let package = program.of().display().to_string();
        let tests = program.tests().unwrap_or_else(|error| {
            times.fails(package.clone(), &error);
            Vec::new()
        });
        for test in tests {
            let is_asked_for = match is_of_viewer {
                true => belongs_to_viewer(&package, &test),
                false => words.is_empty() || words.iter().any(|word| test.contains(word)),
            };
            if is_asked_for {
                times.take(format!("{package} {test}"), || alone(&program, &test));
            }
        }
    }
    if is_of_viewer {
        times.take("the window".to_owned(), window::check);
    }
    times.rows.sort();
    println!("\ndearest first:");
    times.rows.iter().rev().for_each(told);
    let all: Duration = times.rows.iter().map(|(taken, _)| *taken).sum();
    println!("{:>8.2} s  of a processor, all {}", all.as_secs_f64(), times.rows.len());
    match &*times.failed {
        [] => Ok(()),
        failed => bail!("failed: {}", failed.join(", ")),
    }
}

/// Runs a test of a program.
fn alone(program: &test_programs::Program, test: &str) -> Result<Outcome> {
    let ended = within(program.alone(test).env("PROPTEST_RNG_SEED", SEED), test_programs::LIMIT)?;
    if !ended.status.success() {
        let said = [ended.stdout, ended.stderr].concat();
        bail!("{}: {}", ended.status, String::from_utf8_lossy(&said));
    }
    Ok(Outcome::Passed)
}

/// What has been taken so far, and the names of what failed.
#[derive(Default)]
struct Times {
    rows: Vec<Row>,
    failed: Vec<String>,
}

type Row = (Duration, String);

impl Times {
    /// Takes the time of something, which is told at once, also where it fails; what hangs is no reason to
    /// lose what was taken before.
    fn take(&mut self, name: String, run: impl FnOnce() -> Result<Outcome>) {
        let before = shell::processor_time().unwrap_or_default();
        let ended = run();
        let taken = shell::processor_time().unwrap_or_default().saturating_sub(before);
        match ended {
            Ok(Outcome::Passed) => {}
            Ok(Outcome::Skipped(why)) => return println!(" skipped    {name}: {why}"),
            Err(error) => self.fails(name.clone(), &error),
        }
        let row = (taken, name);
        told(&row);
        self.rows.push(row);
    }

    fn fails(&mut self, name: String, error: &anyhow::Error) {
        eprintln!("  failed    {name}: {error:#}");
        self.failed.push(name);
    }
}

fn told((taken, name): &Row) {
    println!("{:>8.2} s  {name}", taken.as_secs_f64());
}

fn belongs_to_viewer(package: &str, test: &str) -> bool {
    let of_package = OF_VIEWER.iter().filter(|(known, _)| *known == package);
    of_package.flat_map(|(_, tests)| *tests).any(|begin| test.starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_or_is_skipped_loses_nothing() {
        let mut times = Times::default();
        times.take("a".to_owned(), || Ok(Outcome::Passed));
        times.take("b".to_owned(), || bail!("has not ended and was killed"));
        times.take("c".to_owned(), || Ok(Outcome::Skipped("no display".to_owned())));
        times.take("d".to_owned(), || Ok(Outcome::Passed));
        let names: Vec<&str> = times.rows.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!((names, &times.failed[..]), (vec!["a", "b", "d"], &["b".to_owned()][..]));
    }

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
