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
mod texts;
mod uploads;
mod world;

use anyhow::Result;
use vastex_scenes::GpuClock;
use world::{Bench, VERDICT, gpu};

const SECTIONS: &[fn(&Bench) -> Result<String>] = &[
    operations::section,
    filters::section,
    fading::section,
    feedback::section,
    tables::section,
    second_level::section,
    sizes::section,
    uploads::section,
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
    let mut verdicts = Vec::new();
    for section in SECTIONS {
        let page = section(&bench)?;
        verdicts.extend(page.lines().filter(|line| line.starts_with(VERDICT)).map(str::to_owned));
        println!("\n{}", page.trim_end());
    }
    println!("\n## Verdicts\n\nOne for each thing that is asked of a GPU.\n");
    for verdict in verdicts {
        println!("- {}", verdict.trim_start_matches(VERDICT));
    }
    Ok(())
}
