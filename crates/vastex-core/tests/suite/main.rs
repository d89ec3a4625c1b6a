//! The integration tests of the deciding part, in one program; `steady.rs` beside it counts allocations, so
//! it has a process of its own.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "helpers of tests fail by panicking, and figures are printed"
)]

mod bias;
mod bounds;
mod explain;
mod fair_share;
mod gaps;
mod groups;
mod learnt;
mod pools;
mod prediction;
mod ranks;
mod requests;
mod rest;
mod several_views;
mod sharing;
mod telemetry;
mod usage;
mod views;
mod worlds;
