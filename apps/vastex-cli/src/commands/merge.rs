//! `vastex merge`: joins the parts of a container.

use std::ops::ControlFlow;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use serde::Serialize;
use vastex_build::MergeError;

use super::build::{INTERRUPTED, handle_interrupts, is_interrupted};
use crate::args::MergeArgs;
use crate::{progress, report};

pub(crate) fn run(args: &MergeArgs) -> Result<ExitCode> {
    handle_interrupts()?;
    let bar = progress::bar(args.print.quiet, "", "tile");
    let begin = Instant::now();
    let merged = vastex_build::merge(&args.parts, &args.output, args.disk.durable, |done, total| {
        bar.set_length(total);
        bar.set_position(done);
        if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.finish_and_clear();
    let merged = match merged {
        Err(MergeError::Cancelled) => {
            report::say("interrupted; nothing was left behind");
            return Ok(ExitCode::from(INTERRUPTED));
        }
        merged => merged?,
    };
    let summary = Summary {
        output: args.output.display().to_string(),
        parts: args.parts.len(),
        tiles: merged.tiles,
        constant_tiles: merged.constant_tiles,
        shared_tiles: merged.shared_tiles,
        bytes: merged.bytes,
        seconds: begin.elapsed().as_secs_f64(),
    };
    args.print.summary(&summary, Summary::text)?;
    Ok(ExitCode::SUCCESS)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    output: String,
    parts: usize,
    tiles: u64,
    constant_tiles: u64,
    shared_tiles: u64,
    /// Of the file.
    bytes: u64,
    seconds: f64,
}

impl Summary {
    fn text(&self) -> String {
        let Summary { output, parts, tiles, seconds, .. } = self;
        let bytes = report::bytes(self.bytes);
        format!("{output}: {tiles} tiles of {parts} parts; {bytes} in {seconds:.1} s")
    }
}
