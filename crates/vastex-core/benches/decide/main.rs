//! What deciding costs on one core: from a raw feedback target to distinct pages, and from these to a frame's
//! decisions.
//!
//! `cargo xtask bench decide`. Both sides of a comparison take turns, so that a noisy machine slows both;
//! times are medians over the turns. Given names of parts (`compaction`, `frame`, `sweep`, `many`,
//! `crowded`), it measures these alone.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark")]

mod compaction;
mod crowded;
mod frame;
mod many;
mod plot;
mod sweep;

use std::time::{Duration, Instant};

const TURNS: usize = 200;

fn main() {
    let parts: [(&str, fn()); 5] = [
        ("compaction", compaction::measure),
        ("frame", frame::measure),
        ("sweep", sweep::measure),
        ("many", many::measure),
        ("crowded", crowded::measure),
    ];
    let named: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let is_asked_for = |part: &str| named.is_empty() || named.iter().any(|name| name == part);
    parts.iter().filter(|(part, _)| is_asked_for(part)).for_each(|(_, measure)| measure());
}

/// The median, by turns, of the time that each of several pieces of work takes.
fn medians<const N: usize>(mut work: [&mut dyn FnMut(); N]) -> [Duration; N] {
    let mut times = [const { Vec::new() }; N];
    for _ in 0..TURNS {
        for (work, times) in work.iter_mut().zip(&mut times) {
            let start = Instant::now();
            work();
            times.push(start.elapsed());
        }
    }
    times.map(|mut times| {
        times.sort_unstable();
        times[TURNS / 2]
    })
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

fn says(holds: bool) -> &'static str {
    if holds { "holds" } else { "DOES NOT HOLD" }
}
