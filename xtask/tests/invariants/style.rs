//! The style that no lint of the compiler knows.

use anyhow::{Context, Result, ensure};

use crate::sources::{all_texts, files, root};

/// Lines that a file may have before it must be split or stand in [`LONG`].
const MOST_LINES: usize = 500;

/// Files that are longer, each with the reason.
const LONG: &[(&str, &str)] = &[];

#[test]
fn no_file_outgrows_its_room() -> Result<()> {
    for source in files(&["rs", "wgsl"])? {
        let lines = source.text.lines().count();
        let listed = LONG.iter().any(|(path, _)| *path == source.path);
        ensure!(
            lines <= MOST_LINES || listed,
            "{} has {lines} lines: split it, or list it with a reason",
            source.path
        );
        ensure!(
            lines > MOST_LINES || !listed,
            "{} has only {lines} lines: take it off the list",
            source.path
        );
    }
    for (path, reason) in LONG {
        ensure!(
            root().join(path).is_file() && !reason.is_empty(),
            "{path} is listed without being there, or without a reason"
        );
    }
    Ok(())
}

#[test]
fn every_file_says_first_what_it_is_for() -> Result<()> {
    for source in files(&["rs"])? {
        ensure!(source.text.starts_with("//! "), "{} does not begin with a //! head", source.path);
    }
    for source in files(&["wgsl"])? {
        ensure!(source.text.starts_with("// "), "{} does not begin with a comment", source.path);
    }
    Ok(())
}

/// Comments are as wide as the code. Tables, links and examples of code in them are as they must be.
#[test]
fn comments_are_as_wide_as_the_code() -> Result<()> {
    const WIDTH: usize = 110;
    let mut wide = Vec::new();
    for source in files(&["rs"])? {
        let mut is_code = false;
        for (index, line) in source.text.lines().enumerate() {
            let Some(comment) = line.trim_start().strip_prefix("//") else {
                is_code = false;
                continue;
            };
            let comment = comment.trim_start_matches(['/', '!']).trim_start();
            is_code ^= comment.starts_with("```");
            let is_laid_out = is_code || comment.starts_with('|') || !comment.contains(' ');
            if !is_laid_out && line.chars().count() > WIDTH && !comment.contains("](") {
                wide.push(format!("{}:{}", source.path, index + 1));
            }
        }
    }
    ensure!(wide.is_empty(), "comments of over {WIDTH} columns: {}", wide.join(", "));
    Ok(())
}

#[test]
fn nothing_points_outside_the_project() -> Result<()> {
    // Written in halves, so that this file does not find itself.
    let outside =
        [("../", "shared"), ("/wo", "rk/"), ("/fa", "rm/")].map(|(left, right)| format!("{left}{right}"));
    for source in all_texts()? {
        for (index, line) in source.text.lines().enumerate() {
            let found = outside.iter().find(|path| line.contains(path.as_str()));
            ensure!(found.is_none(), "{}:{}: points outside the project", source.path, index + 1);
        }
    }
    Ok(())
}

#[test]
fn every_crate_obeys_the_workspace() -> Result<()> {
    let manifests = files(&["toml"])?.into_iter().filter(|source| source.path.ends_with("/Cargo.toml"));
    // What is compiled in its own way is a workspace of its own.
    for manifest in manifests.filter(|manifest| !manifest.text.contains("\n[workspace]\n")) {
        for line in ["[lints]\nworkspace = true", "version.workspace = true", "license.workspace = true"] {
            ensure!(manifest.text.contains(line), "{} lacks '{}'", manifest.path, line.replace('\n', " "));
        }
    }
    Ok(())
}

#[test]
fn every_asset_has_its_provenance() -> Result<()> {
    let readme = std::fs::read_to_string(root().join("assets/README.md"))?;
    for entry in std::fs::read_dir(root().join("assets"))? {
        let name = entry?.file_name().into_string().ok().context("an asset's name is not UTF-8")?;
        let rows = readme.lines().filter(|line| line.contains(&format!("`{name}`")));
        ensure!(name == "README.md" || rows.count() == 1, "assets/README.md has no row for {name}");
    }
    Ok(())
}
