//! What drawing costs on the adapter of this machine, as parts of a page: `cargo xtask bench draw`.
//!
//! Each section is a file and gives its part as text; a new one is added to `SECTIONS`. What is compared is drawn in turns.

#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

mod fading;
mod feedback;
mod filters;
mod lookups;
mod operations;
mod second_level;
mod sizes;
mod stage;
mod tables;
mod world;

use anyhow::Result;
use vastex_scenes::GpuClock;
use world::{Bench, gpu};

const SECTIONS: &[fn(&Bench) -> Result<String>] = &[
    operations::section,
    filters::section,
    fading::section,
    feedback::section,
    tables::section,
    second_level::section,
    sizes::section,
];

fn main() -> Result<()> {
    let gpu = gpu()?;
    let clock = GpuClock::new(&gpu);
    println!(
        "Adapter: {}. Times are told by {}; each is the least of several, taken in turns.",
        gpu.adapter_name(),
        clock.told_by()
    );
    let bench = Bench { gpu, clock };
    for section in SECTIONS {
        println!("\n{}", section(&bench)?.trim_end());
    }
    Ok(())
}
