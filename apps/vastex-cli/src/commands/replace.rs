//! `vastex replace`: puts an image into a region of a container.

use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use serde::Serialize;
use vastex_build::{ReplaceError, ReplaceOptions};

use super::build::{Bar, INTERRUPTED, handle_interrupts};
use crate::args::ReplaceArgs;
use crate::{open, report};

pub(crate) fn run(args: &ReplaceArgs) -> Result<ExitCode> {
    handle_interrupts()?;
    let images = args.images();
    open::refuse_generated([&*args.file], ("changed", "name a container"))?;
    let paths = images.iter().map(|image| &*image.path);
    open::refuse_generated(
        paths,
        ("put into a container", "write a region of it with `vastex crop`, and name that"),
    )?;
    let options = ReplaceOptions {
        threads: args.threads.count(),
        quality: args.quality.into(),
        durable: args.disk.durable,
        tolerant: args.tolerant,
        ..ReplaceOptions::default()
    };
    let bar = Bar::new(args.print.quiet);
    let begin = Instant::now();
    let replaced = vastex_build::replace(&args.file, args.at, &images, &options, &bar);
    bar.0.finish_and_clear();
    let replaced = match replaced {
        Err(ReplaceError::Cancelled) => {
            report::say("interrupted; the container is as it was");
            return Ok(ExitCode::from(INTERRUPTED));
        }
        replaced => replaced?,
    };
    if !args.print.quiet {
        replaced.notices.iter().for_each(|(image, notice)| report::say_of_image(image, notice));
    }
    let updated = replaced.updated;
    let summary = Summary {
        file: args.file.display().to_string(),
        tiles: updated.tiles,
        bytes_added: updated.bytes_added,
        bytes_superseded: updated.bytes_superseded,
        bytes: updated.bytes,
        seconds: begin.elapsed().as_secs_f64(),
        notices: replaced.notices.iter().map(|(_, notice)| notice.to_string()).collect(),
    };
    args.print.summary(&summary, Summary::text)?;
    Ok(ExitCode::SUCCESS)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    file: String,
    /// Pages that have a new tile.
    tiles: u64,
    /// Bytes by which the file grew.
    bytes_added: u64,
    /// Bytes that belong to earlier versions only.
    bytes_superseded: u64,
    /// Of the file.
    bytes: u64,
    seconds: f64,
    notices: Vec<String>,
}

impl Summary {
    fn text(&self) -> String {
        let Summary { file, tiles, seconds, .. } = self;
        let [added, old, bytes] = [self.bytes_added, self.bytes_superseded, self.bytes].map(report::bytes);
        format!(
            "{file}: {tiles} tiles replaced, {added} added in {seconds:.1} s; of {bytes}, {old} belong to earlier versions"
        )
    }
}
