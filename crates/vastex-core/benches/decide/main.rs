//! What deciding costs on one core: from a raw feedback target to distinct pages, and from these to a frame's decisions.
//!
//! `cargo xtask bench decide`. Both sides of a comparison take turns, so that a noisy machine slows both; times are medians
//! over the turns.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark")]

mod compaction;
mod frame;
mod plot;
mod sweep;

use std::time::{Duration, Instant};

const TURNS: usize = 200;

fn main() {
    compaction::measure();
    frame::measure();
    sweep::measure();
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
