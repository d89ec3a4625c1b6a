//! What the help of `cargo xtask` lists is what there is.

use std::fs;

use anyhow::{Context, Result, ensure};

use crate::sources::root;

#[test]
fn the_help_names_every_section_of_the_benchmark_of_drawing() -> Result<()> {
    let between = |path: &str, begin: &str, end: &str| -> Result<String> {
        let text = fs::read_to_string(root().join(path)).with_context(|| path.to_owned())?;
        let (_, rest) =
            text.split_once(begin).with_context(|| format!("{path} says nothing like {begin:?}"))?;
        let (list, _) =
            rest.split_once(end).with_context(|| format!("{path}: no {end:?} after {begin:?}"))?;
        Ok(list.to_owned())
    };
    let sections = between("apps/scenes/benches/draw/main.rs", "const SECTIONS", "];")?;
    let sections: Vec<&str> = sections.split('"').skip(1).step_by(2).collect();
    ensure!(sections.len() > 5, "the sections are declared in another way: {sections:?}");
    let help = between("xtask/src/main.rs", "bench draw SECTION..", "\n")?;
    let (_, named) = help.split_once("only these: ").context("the help of bench draw has changed")?;
    ensure!(named.split(", ").eq(sections.iter().copied()), "the help names {named}; there are {sections:?}");
    Ok(())
}
