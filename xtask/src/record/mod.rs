//! A record of what the project does, as plain files, and what of it differs from another version's.
//!
//! | part | what it holds |
//! |---|---|
//! | `worlds/` | decisions and events of simulated worlds, traces, sets learnt of them, replays |
//! | `frames/` | feedback, page tables and pictures of scenes and volumes, in lock-step |
//! | `files.txt` | hashes of containers, parts, journals and exports that are made of fixed inputs |
//! | `help.txt`, `json.txt` | what commands say of themselves, and the keys of what they print with `--json` |
//! | `names.txt` | the public names of crate `vastex`, with their signatures |
//! | `tests.txt` | the tests of the workspace |
//!
//! There are no times, paths and addresses in it, and the order is always the same, so that two records of
//! one version are equal on one machine. What knows types of Vastex stands in the program (`vastex record`,
//! which its help does not show); here are programs and lines.

pub mod compare;
mod diff;
mod files;
mod frames;
pub mod help;
mod inputs;
mod json;
pub mod names;
mod steps;
pub mod test_list;
mod volumes;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};

use crate::limited::within;

pub use files::record as files;
pub use frames::{FEW as FEW_FRAMES, record as frames};
pub use json::{Leaf, leaves};
pub use steps::FEW as FEW_STEPS;

/// Longer than any program of a record takes on any machine; one that hangs is killed then.
const LIMIT: Duration = Duration::from_secs(60 * 60);

/// A built program, and where it may work.
#[derive(Clone, Debug)]
pub struct Program {
    /// The program `vastex`.
    pub path: PathBuf,
}

impl Program {
    /// The program, to be run in a directory, with nothing of the environment that could change what it does.
    pub fn command(&self, directory: &Path) -> Command {
        let mut command = Command::new(&self.path);
        clean(&mut command);
        command.current_dir(directory).stdin(Stdio::null());
        command
    }

    /// What it prints on its standard output; fails where it fails.
    pub fn output(&self, directory: &Path, words: &[&str]) -> Result<Vec<u8>> {
        let output = within(self.command(directory).args(words), LIMIT)?;
        if !output.status.success() {
            bail!("`vastex {}` failed: {}", words.join(" "), said(&output));
        }
        Ok(output.stdout)
    }
}

/// Takes away what a person may have set for other ends.
fn clean(command: &mut Command) {
    for name in ["RUST_LOG", "COLUMNS", "CLICOLOR_FORCE", "RUST_BACKTRACE", "VASTEX_SHADER_LOG"] {
        command.env_remove(name);
    }
}

/// What a program said of a failure, on one line.
fn said(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let error = text.lines().rev().find(|line| line.contains("error: "));
    error.or(text.trim().lines().last()).unwrap_or("nothing").to_owned()
}

/// Worlds: all, or those whose names begin so.
pub fn worlds(program: &Program, directory: &Path, only: &str) -> Result<()> {
    let into = make(&directory.join("worlds"))?;
    program.output(&into, &["record", "worlds", ".", "--only", only]).map(drop)
}

/// A directory that is there and empty.
pub fn make(directory: &Path) -> Result<PathBuf> {
    if directory.exists() {
        fs::remove_dir_all(directory).with_context(|| format!("cannot remove {}", directory.display()))?;
    }
    fs::create_dir_all(directory).with_context(|| format!("cannot make {}", directory.display()))?;
    Ok(directory.canonicalize()?)
}

fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}

/// Every file under a directory, as names parted by `/`, in order.
fn files_under(directory: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    let mut directories = vec![String::new()];
    while let Some(prefix) = directories.pop() {
        let entries = fs::read_dir(directory.join(&prefix))
            .with_context(|| format!("cannot read {}", directory.display()))?;
        for entry in entries {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            match entry.file_type()?.is_dir() {
                true => directories.push(format!("{name}/")),
                false => names.push(name),
            }
        }
    }
    names.sort();
    Ok(names)
}

/// Runs jobs on all processors, each on whichever is free; fails with the first that fails.
fn at_once<T: Sync>(jobs: &[T], run: impl Fn(&T) -> Result<()> + Sync) -> Result<()> {
    let next = std::sync::atomic::AtomicUsize::new(0);
    let work = || -> Result<()> {
        while let Some(job) = jobs.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
            run(job)?;
        }
        Ok(())
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
    std::thread::scope(|scope| {
        let working: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        working.into_iter().try_for_each(|thread| match thread.join() {
            Ok(done) => done,
            Err(_) => bail!("a thread of the record panicked"),
        })
    })
}
