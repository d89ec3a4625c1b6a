//! A fixed sample of damaged inputs for every reader and for the exporter, and every input that ever did
//! harm.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

use std::path::{Path, PathBuf};

use vastex_fuzz::{Limit, PATIENCE, TARGETS, Target, run};

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Reads all that stands in `regressions/NAME`, and so many damaged inputs: a hundred or more of each seed,
/// but for profiles. `cargo xtask campaign fuzz` goes on from there.
fn sample(name: &str, cases: u64) {
    let target = Target::named(name).unwrap();
    let regressions = here("regressions").join(name);
    let entries =
        std::fs::read_dir(&regressions).unwrap_or_else(|e| panic!("{}: {e}", regressions.display()));
    let mut kept = 0;
    for entry in entries {
        target.check(&std::fs::read(entry.unwrap().path()).unwrap());
        kept += 1;
    }
    assert!(kept > 0, "{} is empty", regressions.display());
    let ran = run(target, 1, Limit::Cases(cases), PATIENCE).unwrap();
    if let Some(failure) = ran.failed {
        let path = std::env::temp_dir().join(format!("vastex-fuzz-{name}-1-{}", failure.case));
        std::fs::write(&path, failure.input).unwrap();
        panic!(
            "case {} {:?}; `cargo run -p vastex-fuzz {name} --replay {}`, then keep it in {}",
            failure.case,
            failure.harm,
            path.display(),
            regressions.display()
        );
    }
    assert_eq!(ran.cases, cases);
}

#[test]
fn container() {
    sample("container", 40_000);
}

#[test]
fn part() {
    sample("part", 4_000);
}

#[test]
fn image() {
    sample("image", 5_000);
}

/// Few: each makes a table of thousands of colours.
#[test]
fn profile() {
    sample("profile", 25);
}

#[test]
fn raw() {
    sample("raw", 1_500);
}

#[test]
fn mosaic() {
    sample("mosaic", 1_500);
}

#[test]
fn deep_zoom() {
    sample("deep_zoom", 800);
}

#[test]
fn gaia_sky() {
    sample("gaia_sky", 900);
}

#[test]
fn celestia() {
    sample("celestia", 600);
}

#[test]
fn prototype() {
    sample("prototype", 400);
}

#[test]
fn export() {
    sample("export", 900);
}

/// Every target is sampled here, can be fuzzed with coverage, and is known to `cargo xtask campaign fuzz`.
#[test]
fn no_target_is_left_out() {
    let read = |path: &str| std::fs::read_to_string(here(path)).unwrap();
    let (suite, manifest, campaign) =
        (read("tests/suite.rs"), read("../../fuzz/Cargo.toml"), read("../../xtask/src/damage.rs"));
    for Target { name, .. } in TARGETS {
        assert!(suite.contains(&format!("sample(\"{name}\", ")), "{name}");
        assert!(manifest.contains(&format!("path = \"targets/{name}.rs\"")), "{name}");
        assert!(campaign.contains(&format!("\"{name}\"")), "{name}");
        assert!(
            read(&format!("../../fuzz/targets/{name}.rs")).contains(&format!("fuzz!(\"{name}\")")),
            "{name}"
        );
    }
}

#[test]
fn volume() {
    sample("volume", 4_000);
}
