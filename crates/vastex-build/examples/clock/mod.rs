//! What measuring examples measure with: wall time, and the CPU time of this program, which a busy machine
//! disturbs less.
#![allow(dead_code, reason = "each example uses a part of it")]

use std::time::Instant;

/// Seconds.
#[derive(Clone, Copy)]
pub(crate) struct Took {
    pub(crate) wall: f64,
    /// Of all threads; 0 where the system is not Linux.
    pub(crate) cpu: f64,
}

/// Runs something.
pub(crate) fn time(work: impl FnOnce()) -> Took {
    let (begin, cpu) = (Instant::now(), cpu_seconds());
    work();
    Took { wall: begin.elapsed().as_secs_f64(), cpu: cpu_seconds() - cpu }
}

/// The middle one, or the upper one of two in the middle. Not of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// User and system time of this program until now, in steps of 1/100 s: fields 14 and 15 of what Linux says
/// of it.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
