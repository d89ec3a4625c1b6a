//! The locks of what is no part of the workspace, and so is not built with it, are those that cargo would
//! write today: whoever builds it gets the crates that were tried.

use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::sources::root;

/// Manifests that the workspace leaves out.
fn excluded() -> Result<Vec<String>> {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml"))?;
    let (_, rest) = manifest.split_once("\nexclude = [").context("the workspace leaves nothing out")?;
    let (list, _) = rest.split_once(']').context("the list of what the workspace leaves out has no end")?;
    Ok(list.split('"').skip(1).step_by(2).map(|folder| format!("{folder}/Cargo.toml")).collect())
}

/// Crates that nobody has downloaded here are not looked at: what is missing is said after the lock was held
/// against the manifests, or, where not even the index of such a crate is there, in place of that.
#[test]
fn locks_of_what_the_workspace_leaves_out_are_not_stale() -> Result<()> {
    let excluded = excluded()?;
    ensure!(excluded.len() > 2, "what the workspace leaves out is named in another way: {excluded:?}");
    for manifest in excluded {
        let output = Command::new(env!("CARGO"))
            .args([
                "metadata",
                "--locked",
                "--offline",
                "--format-version",
                "1",
                "--manifest-path",
                &manifest,
            ])
            .current_dir(root())
            .output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(
            !said.contains("the lock file"),
            "the lock of {manifest} is stale; `cargo metadata --manifest-path {manifest}` renews it: {said}"
        );
        let is_missing =
            ["--offline was specified", "offline mode (--offline)"].map(|part| said.contains(part));
        ensure!(output.status.success() || is_missing.contains(&true), "{manifest}: {said}");
    }
    Ok(())
}
