//! `vastex replay`: a trace under a policy, beside Belady's optimum.

use std::io::Read;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail};
use serde::Serialize;
use vastex::prefetch::Trace;
use vastex_core::{Replay, ReplaySettings, replay};
use vastex_tiles::read_advice;

use crate::args::ReplayArgs;
use crate::report;

/// Bytes of a trace that are read at most; an hour of a large view has far fewer.
const MAX_BYTES: u64 = 2 << 30;

pub(crate) fn run(args: &ReplayArgs) -> Result<ExitCode> {
    let name = || args.file.display().to_string();
    let trace = read(&args.file).with_context(name)?;
    let settings = ReplaySettings {
        policy: args.policy,
        pool: args.pool(),
        latency_frames: args.latency_frames,
        tiles_per_frame: args.tiles_per_frame.0,
    };
    let replayed = replay(&trace, &settings).with_context(name)?;
    let summary = Summary::new(&replayed, &settings);
    match args.json {
        true => report::print_json(&summary)?,
        false => report::print(&format!("{}\n{}", name(), summary.text()))?,
    }
    Ok(ExitCode::SUCCESS)
}

/// A trace from its file.
pub(crate) fn read(file: &Path) -> Result<Trace> {
    Ok(Trace::from_bytes(&read_bytes(file)?)?)
}

/// The bytes of a recorded file.
pub(crate) fn read_bytes(file: &Path) -> Result<Vec<u8>> {
    let unreadable = |error: std::io::Error| anyhow!("it cannot be read: {}", read_advice(&error));
    // Looked at before it is opened: opening a pipe would wait for a writer, and a device need not end.
    let found = std::fs::metadata(file).map_err(unreadable)?;
    if !found.is_file() {
        let what = if found.is_dir() { "a directory" } else { "a device or a pipe" };
        bail!("it cannot be read: this is {what}; name a file");
    }
    let mut bytes = Vec::new();
    let opened = std::fs::File::open(file);
    let read = opened.and_then(|opened| opened.take(MAX_BYTES + 1).read_to_end(&mut bytes));
    read.map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        bail!("more than {}; record fewer frames", report::bytes(MAX_BYTES));
    }
    Ok(bytes)
}

/// What `--json` prints. Scripts rely on these names.
#[derive(Serialize)]
struct Summary {
    policy: &'static str,
    frames: u64,
    /// Distinct ones, ancestors and tails included.
    pages: u64,
    working_set_max: u64,
    pool_tiles: u64,
    loads: u64,
    loads_optimum: u64,
    /// Loads divided by those of the optimum.
    ratio: f64,
    evictions: u64,
    /// Of tiles that had been loaded before.
    reloads: u64,
    #[serde(flatten)]
    timed: Option<Timed>,
}

/// What latency or a limit adds.
#[derive(Serialize)]
struct Timed {
    latency_frames: u64,
    tiles_per_frame: Option<u64>,
    /// Tiles that came when nobody wanted them any more, and found the pool full.
    wasted: u64,
    /// Views that began.
    cuts: u64,
    /// Summed over the views.
    frames_to_full: u64,
    frames_to_full_bound: u64,
    /// Summed over the frames.
    missing_level_frames: f64,
}

impl Summary {
    fn new(replayed: &Replay, settings: &ReplaySettings) -> Summary {
        let is_timed = settings.latency_frames > 0 || settings.tiles_per_frame.is_some();
        Summary {
            policy: settings.policy.name(),
            frames: replayed.frames,
            pages: replayed.pages,
            working_set_max: replayed.working_set_max,
            pool_tiles: replayed.pool_tiles,
            loads: replayed.loads,
            loads_optimum: replayed.loads_optimum,
            ratio: replayed.ratio(),
            evictions: replayed.evictions,
            reloads: replayed.reloads,
            timed: is_timed.then_some(Timed {
                latency_frames: settings.latency_frames,
                tiles_per_frame: settings.tiles_per_frame,
                wasted: replayed.wasted,
                cuts: replayed.cuts,
                frames_to_full: replayed.frames_to_full,
                frames_to_full_bound: replayed.frames_to_full_bound,
                missing_level_frames: replayed.missing_level_frames,
            }),
        }
    }

    fn text(&self) -> String {
        let mut rows = vec![
            format!(
                "{} frames over {} pages; the largest frame's set has {}",
                self.frames, self.pages, self.working_set_max
            ),
            format!("{}, a pool of {} tiles", self.policy, self.pool_tiles),
            format!(
                "{} loads, {:.3} times the optimum of {}; {} reloads, {} evictions",
                self.loads, self.ratio, self.loads_optimum, self.reloads, self.evictions
            ),
        ];
        if let Some(timed) = &self.timed {
            rows.push(format!(
                "{} frames until {} views were complete, at least {}; {:.1} levels x frames missing, {} tiles wasted",
                timed.frames_to_full,
                timed.cuts,
                timed.frames_to_full_bound,
                timed.missing_level_frames,
                timed.wasted
            ));
        }
        rows.join("\n")
    }
}
