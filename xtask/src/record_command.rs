//! `cargo xtask record`: what must stay while code moves, written down and compared.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use xtask::record::{self, Program};

use crate::outcome::cargo_test;
use crate::setup;
use crate::shell::{self, Usage};

const PARTS: [&str; 6] = ["worlds", "frames", "files", "help", "names", "tests"];

struct Options {
    directory: PathBuf,
    compare: bool,
    parts: Vec<&'static str>,
}

/// `cargo xtask record DIR [--compare] [--only PART,..]`; `own` is this program's help.
pub(crate) fn run(options: &[&str], own: &str) -> Result<()> {
    let Options { directory, compare, parts } = parse(options)?;
    if !compare {
        refuse_others(&directory)?;
    }
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    let program = build()?;
    if !compare {
        record(&program, own, &directory, &parts)?;
        println!("recorded in {}", directory.display());
        return Ok(());
    }
    ensure!(directory.is_dir(), "{} is not there to compare with; record it first", directory.display());
    let fresh = shell::target_dir().join("record");
    record::make(&fresh)?;
    record(&program, own, &fresh, &parts)?;
    let found = record::compare::compare(&program, &directory, &fresh, &parts)?;
    found.differences.iter().for_each(|difference| println!("{difference}"));
    found.notes.iter().for_each(|note| println!("note: {note}"));
    print!("\n{}", found.summary());
    if !found.differences.is_empty() {
        bail!("the record is another; the new one lies in {}", fresh.display());
    }
    Ok(())
}

/// A record replaces what an earlier one left, so a directory that is anything else is not written into.
fn refuse_others(directory: &Path) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(directory) else { return Ok(()) };
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let part = name.strip_suffix(".txt").unwrap_or(&name);
        ensure!(
            part == "json" || PARTS.contains(&part),
            "{} holds '{name}', which is no part of a record; name a directory that is new, empty or a record",
            directory.display()
        );
    }
    Ok(())
}

fn parse(options: &[&str]) -> Result<Options> {
    let usage = |what: String| -> anyhow::Error { Usage(what).into() };
    let (mut directory, mut compare, mut parts) = (None, false, PARTS.to_vec());
    let mut options = options.iter();
    while let Some(option) = options.next() {
        match *option {
            "--compare" => compare = true,
            "--only" => {
                let named: Vec<&str> = options.next().unwrap_or(&"").split(',').collect();
                if let Some(unknown) = named.iter().find(|name| !PARTS.contains(name)) {
                    return Err(usage(format!(
                        "record has no part '{unknown}'; there are: {}",
                        PARTS.join(", ")
                    )));
                }
                parts.retain(|part| named.contains(part));
            }
            name if directory.is_none() && !name.starts_with('-') => {
                directory = Some(std::env::current_dir()?.join(name));
            }
            other => return Err(usage(format!("record takes no '{other}'"))),
        }
    }
    let directory =
        directory.ok_or_else(|| usage("record takes a directory: cargo xtask record DIR".to_owned()))?;
    Ok(Options { directory, compare, parts })
}

/// The program as the suite builds it, so that nothing is compiled twice, and the one that has the small
/// sound files.
fn build() -> Result<Program> {
    shell::run(shell::cargo("build").args(["--quiet", "--workspace", "--bins", "--example", "shaders"]))?;
    Ok(Program { path: built("vastex") })
}

fn built(name: &str) -> PathBuf {
    shell::target_dir().join("debug").join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

fn record(program: &Program, own: &str, directory: &Path, parts: &[&str]) -> Result<()> {
    std::fs::create_dir_all(directory)?;
    let desk = shell::target_dir().join("record-desk");
    for part in parts {
        let begin = std::time::Instant::now();
        match *part {
            "worlds" => record::worlds(program, directory, "")?,
            "frames" => record::frames(program, &desk, directory, &[])?,
            "files" => {
                let (fuzzer, assets) = (built("vastex-fuzz"), shell::root().join("assets"));
                record::files(program, Some(&fuzzer), Some(&assets), &desk, directory, &[])?;
            }
            "help" => record::help::record(program, own, &desk, directory)?,
            "names" => {
                shell::run(shell::cargo("doc").args(["--quiet", "--workspace", "--lib", "--no-deps"]))?;
                record::names::record(&shell::target_dir().join("doc/vastex"), directory)?;
            }
            _ => {
                let mut command = cargo_test();
                command.args(["--workspace", "--no-run", "--quiet", "--message-format=json"]);
                record::test_list::record(&shell::output(&mut command)?, directory)?;
            }
        }
        println!("{part} took {:.1} s", begin.elapsed().as_secs_f64());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_that_is_no_record_is_not_written_into() {
        let directory = std::env::temp_dir().join(format!("xtask-record-{}", std::process::id()));
        assert!(refuse_others(&directory).is_ok(), "a new one");
        std::fs::create_dir_all(directory.join("frames")).unwrap();
        std::fs::write(directory.join("json.txt"), "").unwrap();
        assert!(refuse_others(&directory).is_ok(), "a record");
        std::fs::write(directory.join("notes.md"), "").unwrap();
        let refused = refuse_others(&directory).unwrap_err().to_string();
        std::fs::remove_dir_all(&directory).unwrap();
        assert!(refused.contains("'notes.md'"), "{refused}");
    }
}
