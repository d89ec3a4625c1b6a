//! Tile directories of other programs: written, read as those programs would, and built again.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

#[path = "../common/mod.rs"]
mod common;
mod hostile;
mod lacking;
mod pictures;
mod programs;
mod refusals;
mod round_trips;
mod sources;
mod trees;
