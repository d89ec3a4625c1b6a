//! A fixed sample of damaged inputs for every reader, and every input that ever did harm.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

use std::path::Path;

use vastex_fuzz::{Limit, Target, run};

/// Counts that come to about a minute of one core's time in all.
fn sample(name: &str, cases: u64) {
    let target = Target::named(name).unwrap();
    let regressions = Path::new(env!("CARGO_MANIFEST_DIR")).join("regressions").join(name);
    for entry in std::fs::read_dir(&regressions).into_iter().flatten() {
        target.check(&std::fs::read(entry.unwrap().path()).unwrap());
    }
    let ran = run(target, 1, Limit::Cases(cases)).unwrap();
    if let Some((case, input)) = ran.failed {
        let path = std::env::temp_dir().join(format!("vastex-fuzz-{name}-1-{case}"));
        std::fs::write(&path, input).unwrap();
        panic!(
            "case {case}; `cargo run -p vastex-fuzz {name} --replay {}`, then keep it in {}",
            path.display(),
            regressions.display()
        );
    }
    assert_eq!(ran.cases, cases);
}

#[test]
fn container() {
    sample("container", 1_000_000);
}

#[test]
fn part() {
    sample("part", 80_000);
}

#[test]
fn image() {
    sample("image", 50_000);
}

#[test]
fn deep_zoom() {
    sample("deep_zoom", 12_000);
}

#[test]
fn gaia_sky() {
    sample("gaia_sky", 12_000);
}

#[test]
fn celestia() {
    sample("celestia", 3_000);
}

#[test]
fn prototype() {
    sample("prototype", 8_000);
}
