//! `vastex verify`: every fault of a container on a line of its own.

use std::process::ExitCode;

use anyhow::Result;
use serde::Serialize;
use vastex_tiles::{Verification, verify_file};

use crate::args::VerifyArgs;
use crate::{open, progress, report};

pub(crate) fn run(args: &VerifyArgs) -> Result<ExitCode> {
    open::refuse_generated([&*args.file], ("verified", "verify the container of its image"))?;
    let bar = progress::bar(args.quiet, "", "tile");
    let found = verify_file(&args.file, |done, total| {
        bar.set_length(total);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    let found = found.or_else(|error| super::info::refuse(&args.file, error))?;
    let file = args.file.display();
    if !args.quiet {
        notes(&found).iter().for_each(|note| report::say(&format!("note: {file}: {note}")));
    }
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

/// What is no fault, but good to know.
fn notes(found: &Verification) -> Vec<String> {
    if found.being_changed {
        return vec!["is being changed now; the version before was checked, which readers have".into()];
    }
    let leftover = found.leftover_bytes;
    let note =
        || format!("{leftover} bytes of an interrupted change; the next `vastex replace` cuts them off");
    (leftover > 0).then(note).into_iter().collect()
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
    /// Of them, those that an interrupted change, or one under way, has appended.
    leftover_bytes: u64,
    being_changed: bool,
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
            leftover_bytes: found.leftover_bytes,
            being_changed: found.being_changed,
        }
    }
}
