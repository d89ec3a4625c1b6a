//! What several commands are told alike: threads, waiting for the disk, and what they print.
//!
//! A command flattens the groups that mean something for it; where it means something of its own by one, it
//! says so in its help.

use anyhow::Result;
use clap::Args as ClapArgs;
use serde::Serialize;

use crate::report;

/// How many threads work.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub(crate) struct ThreadArgs {
    /// Threads that filter and encode [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

impl ThreadArgs {
    /// As the library counts them: 0 for one for each core.
    pub(crate) fn count(self) -> usize {
        self.threads.unwrap_or(0) as usize
    }
}

/// Whether to wait for the disk.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub(crate) struct DiskArgs {
    /// Wait until the disk has everything
    #[arg(long)]
    pub(crate) durable: bool,
}

/// What is printed.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub(crate) struct PrintArgs {
    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

impl PrintArgs {
    /// Prints what was done: as JSON, as a sentence, or not at all.
    pub(crate) fn summary<S: Serialize>(self, summary: &S, text: impl FnOnce(&S) -> String) -> Result<()> {
        match self {
            PrintArgs { json: true, .. } => report::print_json(summary),
            PrintArgs { quiet: true, .. } => Ok(()),
            _ => report::print(&text(summary)),
        }
    }
}
