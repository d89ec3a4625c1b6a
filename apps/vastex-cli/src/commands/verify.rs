//! `vastex verify`: every fault of a container on a line of its own.

use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use vastex_tiles::{FileStore, Verification, verify};

use crate::args::VerifyArgs;
use crate::report;

pub(crate) fn run(args: &VerifyArgs) -> Result<ExitCode> {
    let store = Arc::new(FileStore::open(&args.file)?);
    let bar = if args.quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    if let Ok(style) =
        ProgressStyle::with_template("{bar:32} {percent:>3} %  {pos} of {len} tiles, {per_sec}")
    {
        bar.set_style(style);
    }
    let found = pollster::block_on(verify(store, |done, total| {
        bar.set_length(total);
        bar.set_position(done);
    }));
    bar.finish_and_clear();
    let file = args.file.display();
    if args.json {
        report::print_json(&Summary::new(&found))?;
    } else {
        for fault in &found.faults {
            report::print(&format!("{file}: {fault}"))?;
        }
    }
    if found.faults.is_empty() {
        if !args.quiet && !args.json {
            let (records, bytes) = (found.records, report::bytes(found.bytes));
            report::print(&format!("{file}: sound; {records} distinct tiles, {bytes}"))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let faults = found.faults.len();
    let noun = if faults == 1 { "fault" } else { "faults" };
    report::say(&format!("error: {file}: {faults} {noun}; copy the file anew, or build it again"));
    Ok(ExitCode::FAILURE)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    sound: bool,
    faults: Vec<FaultSummary>,
    /// Distinct tiles that were read.
    records: u64,
    /// Of the file.
    bytes: u64,
}

#[derive(Serialize)]
struct FaultSummary {
    place: String,
    fault: String,
}

impl Summary {
    fn new(found: &Verification) -> Summary {
        let fault = |fault: &vastex_tiles::Fault| FaultSummary {
            place: fault.place.clone(),
            fault: fault.fault.clone(),
        };
        Summary {
            sound: found.faults.is_empty(),
            faults: found.faults.iter().map(fault).collect(),
            records: found.records,
            bytes: found.bytes,
        }
    }
}
