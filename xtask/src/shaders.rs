//! Every shader text of the project: writing them, and the step of the suite that holds them to WGSL.
//!
//! Which there are is known to the example `shaders` of the scenes, which makes them by the functions that
//! make them for a device. This program has no dependency that could, so it runs that.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::outcome::Outcome;
use crate::shell::{self, Usage};
use crate::wgsl;

/// Names a directory into which the tests' programs write every shader text that they hand to a device.
pub(crate) const LOG: &str = "VASTEX_SHADER_LOG";

/// `cargo xtask shaders DIR`.
pub(crate) fn run(arguments: &[&str]) -> Result<()> {
    match arguments {
        [directory] if !directory.starts_with('-') => write(&std::env::current_dir()?.join(directory), None),
        _ => {
            Err(Usage("shaders takes one directory to write into: cargo xtask shaders DIR".to_owned()).into())
        }
    }
}

/// Writes every text into a directory, which is made if there is none; and into another those that browsers
/// are to refuse, which nothing hands to a device.
fn write(directory: &Path, refused: Option<&Path>) -> Result<()> {
    // Of the whole workspace, as the suite builds it: what a crate alone would be built with is compiled
    // anew.
    shell::run(shell::cargo("build").args(["--quiet", "--workspace", "--example", "shaders"]))?;
    let program =
        shell::target_dir().join("debug/examples").join(format!("shaders{}", std::env::consts::EXE_SUFFIX));
    let mut command = Command::new(program);
    command.arg(directory).args(refused);
    shell::run(&mut command)
}

/// Where the suite has them.
pub(crate) fn written() -> PathBuf {
    shell::target_dir().join("shaders")
}

/// Where the suite has those that browsers are to refuse.
pub(crate) fn written_to_be_refused() -> PathBuf {
    written().join("refused")
}

/// Where the suite's tests say which texts they hand to a device.
pub(crate) fn handed_over() -> PathBuf {
    shell::target_dir().join("shaders-handed-over")
}

/// The step: all texts are written, each is held to WGSL's grammar of operators, and those that tests handed
/// to a device are among them.
pub(crate) fn check() -> Result<Outcome> {
    write_anew()?;
    let texts = texts(&written())?;
    let faults = faults(&texts);
    if !faults.is_empty() {
        let first: Vec<&str> = faults.iter().take(10).map(String::as_str).collect();
        bail!("{} places are no WGSL, such as\n{}", faults.len(), first.join("\n"));
    }
    println!("{} texts are WGSL as far as operators go", texts.len());
    if handed_over().is_dir() {
        compare(&texts)?;
    } else {
        println!("no test has handed a text to a device before this step");
    }
    Ok(Outcome::Passed)
}

/// Writes every text to where the suite has them, and none that is no more.
pub(crate) fn write_anew() -> Result<()> {
    remove(&written())?;
    write(&written(), Some(&written_to_be_refused()))
}

/// The places that are no WGSL. Texts have most of their declarations in common, and each of those is looked
/// at once.
fn faults(texts: &[(String, String)]) -> Vec<String> {
    let (mut faults, mut seen) = (Vec::new(), HashSet::new());
    for (name, text) in texts {
        let mut line = 0;
        for part in text.split_inclusive("\n}\n") {
            if seen.insert(part) {
                let whole = |mixed: wgsl::Mixed| wgsl::Mixed { line: line + mixed.line, ..mixed };
                let told = |mixed| format!("{name}, {}", whole(mixed));
                faults.extend(wgsl::mixed(part).into_iter().map(told));
            }
            line += part.matches('\n').count();
        }
    }
    faults
}

/// What tests handed to a device must be among these, to the byte.
fn compare(known: &[(String, String)]) -> Result<()> {
    let directory = handed_over();
    let handed_over = texts(&directory)?;
    let unknown = unknown(known, &handed_over);
    if let Some((name, text)) = unknown.first() {
        bail!(
            "{} of {} shader texts that tests handed to a device are not among those that `cargo xtask shaders` writes; \
             add them to apps/scenes/examples/shaders/list.rs. They lie in {}; {name} has\n{}",
            unknown.len(),
            handed_over.len(),
            directory.display(),
            told(text)
        );
    }
    println!(
        "all {} texts that tests handed to a device are among the {} written",
        handed_over.len(),
        known.len()
    );
    Ok(())
}

/// Those that are not among the known ones, to the byte.
fn unknown<'a>(known: &[(String, String)], handed_over: &'a [(String, String)]) -> Vec<&'a (String, String)> {
    let known: HashSet<&str> = known.iter().map(|(_, text)| text.as_str()).collect();
    handed_over.iter().filter(|(_, text)| !known.contains(text.as_str())).collect()
}

/// Forgets what earlier runs handed over.
pub(crate) fn forget() -> Result<()> {
    remove(&handed_over())
}

/// What a text says of the options that it was made for, and how it begins.
fn told(text: &str) -> String {
    let is_option = |line: &&str| line.starts_with("const VASTEX");
    let lines = text.lines().filter(is_option).chain(text.lines().take(12));
    lines.map(|line| format!("    {line}\n")).collect()
}

fn remove(directory: &Path) -> Result<()> {
    match std::fs::remove_dir_all(directory) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", directory.display()))
        }
        _ => Ok(()),
    }
}

/// The texts in a directory, with their names, in order.
pub(crate) fn texts(directory: &Path) -> Result<Vec<(String, String)>> {
    let mut texts = Vec::new();
    let entries =
        std::fs::read_dir(directory).with_context(|| format!("cannot read {}", directory.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "wgsl") {
            let text =
                std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
            texts.push((path.file_name().unwrap_or_default().to_string_lossy().into_owned(), text));
        }
    }
    texts.sort_unstable();
    Ok(texts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_told_by_their_line_in_the_first_text_that_has_them() {
        let (sound, unsound) = ("fn a() {\n}\n", "fn b() -> u32 {\n    return 1u ^ 2u >> 3u;\n}\n");
        let texts = [("one", [sound, unsound].concat()), ("two", [unsound, unsound].concat())]
            .map(|(name, text)| (name.to_owned(), text));
        let faults = faults(&texts);
        assert!(matches!(&faults[..], [fault] if fault.starts_with("one, line 4: ")), "{faults:?}");
    }

    #[test]
    fn a_text_is_unknown_that_differs_in_a_number_or_in_a_space() {
        let text = |text: &str| (String::new(), text.to_owned());
        let known = [text("const A: u32 = 1u;\n"), text("fn a() {\n}\n")];
        let handed_over =
            ["const A: u32 = 1u;\n", "const A: u32 = 2u;\n", "fn a() {\n}\n", "fn a() {\n}"].map(text);
        let found: Vec<&str> = unknown(&known, &handed_over).iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(found, ["const A: u32 = 2u;\n", "fn a() {\n}"]);
    }
}
