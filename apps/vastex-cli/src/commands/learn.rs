//! `vastex learn`: prefetch sets from recorded traces.

use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde::Serialize;
use vastex::prefetch::{PrefetchSets, Trace};
use vastex_tiles::same_file;

use crate::args::LearnArgs;
use crate::commands::replay;
use crate::output::Output;
use crate::report;

pub(crate) fn run(args: &LearnArgs) -> Result<ExitCode> {
    let place = args.output.display().to_string();
    if args.traces.iter().any(|trace| same_file(trace, &args.output)) {
        bail!("{place}: is a trace as well as the output; choose another name for the output");
    }
    let output = Output::at(&args.output)?;
    let read = |file: &std::path::PathBuf| replay::read(file).with_context(|| file.display().to_string());
    let traces: Vec<Trace> = args.traces.iter().map(read).collect::<Result<_>>()?;
    let names = || args.traces.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ");
    let sets = PrefetchSets::learn(&traces, &args.settings()).with_context(names)?;
    let bytes = sets.to_bytes();
    output.write(&bytes)?;
    let frames = traces.iter().map(|trace| trace.frames().len() as u64).sum();
    let summary = Summary {
        frames,
        cells: sets.cells(),
        pages: sets.pages(),
        cell: sets.sides(),
        bytes: bytes.len() as u64,
    };
    match args.json {
        true => report::print_json(&summary)?,
        false => report::print(&format!("{place}: {}", summary.text()))?,
    }
    Ok(ExitCode::SUCCESS)
}

/// What `--json` prints. Scripts rely on these names.
#[derive(Serialize)]
struct Summary {
    /// Of all traces.
    frames: u64,
    cells: usize,
    /// Of all cells.
    pages: usize,
    /// Sides of a cell.
    cell: [f32; 3],
    /// Of the file.
    bytes: u64,
}

impl Summary {
    fn text(&self) -> String {
        let [a, b, c] = self.cell;
        format!(
            "{} pages in {} cells of {a} x {b} x {c}, from {} frames; {}",
            self.pages,
            self.cells,
            self.frames,
            report::bytes(self.bytes)
        )
    }
}
