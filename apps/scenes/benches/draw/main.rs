//! What drawing costs on the adapter of this machine, as parts of a page: `cargo xtask bench draw`.
//!
//! Each section is a file and gives its part as text; a new one is added to `SECTIONS`. What is compared is drawn in turns.

#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

mod fading;
mod filters;
mod world;

use anyhow::Result;
use vastex_scenes::GpuClock;
use world::{Bench, gpu};

const SECTIONS: &[fn(&Bench) -> Result<String>] = &[filters::section, fading::section];

fn main() -> Result<()> {
    let gpu = gpu()?;
    let clock = GpuClock::new(&gpu);
    let told =
        if clock.has_timestamps() { "its timestamps" } else { "the wall, from submitting to having waited" };
    println!("Adapter: {}. Times are told by {told}, and are medians.", gpu.adapter_name());
    let bench = Bench { gpu, clock };
    for section in SECTIONS {
        println!("\n{}", section(&bench)?.trim_end());
    }
    Ok(())
}
