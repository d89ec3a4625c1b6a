//! Which readers are fuzzed is said in five places, since none of them may depend on another: they must
//! agree.

use std::collections::BTreeSet;
use std::fs;

use anyhow::{Context, Result, ensure};

use crate::sources::root;

/// The words that follow `before` in a text, up to the next `end`, each up to what is no part of a name.
fn names(text: &str, before: &str, end: &str) -> Result<BTreeSet<String>> {
    let (_, rest) = text.split_once(before).with_context(|| format!("nothing says {before:?}"))?;
    let (list, _) = rest.split_once(end).with_context(|| format!("after {before:?} nothing says {end:?}"))?;
    let names = list.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_');
    Ok(names.filter(|name| !name.is_empty()).map(str::to_owned).collect())
}

/// What stands in quotes behind `before`, wherever that is.
fn quoted(text: &str, before: &str) -> BTreeSet<String> {
    text.split(before).skip(1).filter_map(|rest| rest.split('"').nth(1)).map(str::to_owned).collect()
}

#[test]
fn all_lists_of_fuzz_targets_agree() -> Result<()> {
    let read = |path: &str| fs::read_to_string(root().join(path)).with_context(|| path.to_owned());
    let known = quoted(&read("crates/vastex-fuzz/src/targets.rs")?, "Target { name:");
    ensure!(known.len() > 5, "the targets are declared in another way: {known:?}");
    let mut files = BTreeSet::new();
    for entry in fs::read_dir(root().join("fuzz/targets"))? {
        let path = entry?.path();
        files.extend(path.file_stem().map(|name| name.to_string_lossy().into_owned()));
    }
    for (place, found) in [
        ("fuzz/targets", files),
        ("fuzz/Cargo.toml", quoted(&read("fuzz/Cargo.toml")?, "[[bin]]")),
        ("xtask/src/damage.rs", names(&read("xtask/src/damage.rs")?, "const TARGETS: &[&str] = &[", "]")?),
        ("xtask/src/main.rs", names(&read("xtask/src/main.rs")?, "only this one:", "help")?),
    ] {
        ensure!(found == known, "{place} has {found:?}, and crates/vastex-fuzz has {known:?}");
    }
    Ok(())
}
