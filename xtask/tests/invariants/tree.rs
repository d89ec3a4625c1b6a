//! Asking `cargo tree` which crates a build would link.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::sources::root;

/// The target of the browser.
pub(crate) const WASM: &[&str] = &["--target", "wasm32-unknown-unknown"];

/// The names of all crates that `options` bring in, those of build scripts included; of tests only where
/// told.
pub(crate) fn crates(options: &[&str]) -> Result<BTreeSet<String>> {
    Ok(cargo_tree(&[&["--prefix", "none"], options].concat())?.lines().filter_map(name).collect())
}

/// The direct dependencies of each root that `options` name, tests and examples left out.
pub(crate) fn direct(options: &[&str]) -> Result<BTreeMap<String, BTreeSet<String>>> {
    let shape = ["--prefix", "depth", "--depth", "1", "--no-dedupe", "--all-features"];
    let mut direct: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut dependencies = None;
    for line in cargo_tree(&[&shape, options].concat())?.lines() {
        if let Some(package) = line.strip_prefix('0') {
            let package = name(package).context("cargo tree names no package")?;
            dependencies = Some(direct.entry(package).or_default());
        } else if let (Some(package), Some(dependencies)) = (line.strip_prefix('1'), &mut dependencies) {
            dependencies.extend(name(package));
        }
    }
    Ok(direct)
}

/// `-e` in `options` says which kinds of dependencies; by default those of a build.
fn cargo_tree(options: &[&str]) -> Result<String> {
    let mut command = Command::new(env!("CARGO"));
    command.current_dir(root()).arg("tree").args(options);
    if !options.contains(&"-e") {
        command.args(["-e", "normal,build"]);
    }
    let output = command.output().context("cannot start cargo")?;
    ensure!(output.status.success(), "cargo tree {options:?}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(String::from_utf8(output.stdout)?)
}

fn name(line: &str) -> Option<String> {
    line.split_whitespace().next().map(str::to_owned)
}
