//! `vastex record`: what this program decides, draws and reads, as text whose form stays, for `cargo xtask
//! record`.
//!
//! Everything that knows types of Vastex for the sake of a record is here and in the simulated world's log;
//! comparing is xtask's business, and knows lines alone.

mod crowds;
mod frames;
mod picture;
mod text;
mod worlds;

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};

use crate::args::RecordArgs;
use crate::commands::replay;
use crate::report;

pub(crate) fn run(args: &RecordArgs) -> Result<ExitCode> {
    match args {
        RecordArgs::Worlds { directory, only } => worlds::record(directory, only)?,
        RecordArgs::Frames { directory, cases } => frames::record(directory, cases)?,
        RecordArgs::Trace { file } => {
            let trace = replay::read(file).with_context(|| file.display().to_string())?;
            report::print(text::of_trace(&trace).trim_end())?;
        }
        RecordArgs::Difference { was, is } => {
            if let Some(difference) = picture::difference(was, is)? {
                report::print(&difference)?;
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn write(directory: &Path, name: &str, bytes: impl AsRef<[u8]>) -> Result<()> {
    let path = directory.join(name);
    fs::write(&path, bytes).with_context(|| path.display().to_string())
}

fn make(directory: &Path) -> Result<()> {
    fs::create_dir_all(directory).with_context(|| directory.display().to_string())
}
