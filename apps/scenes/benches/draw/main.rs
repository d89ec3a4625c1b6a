//! What drawing costs on the adapter of this machine, as parts of a page: `cargo xtask bench draw`.
//!
//! Each section is a file and gives its part as text; a new one is added to `SECTIONS`. What is compared is
//! drawn in turns.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "the figures are what it is for, and how far it is"
)]

mod fading;
mod feedback;
mod filters;
mod lookups;
mod operations;
mod second_level;
mod sizes;
mod stage;
mod tables;
mod targets;
mod texts;
mod uploads;
mod volumes;
mod world;

use std::time::Instant;

use anyhow::{Result, bail};
use vastex_scenes::GpuClock;
use world::{Bench, Part, gpu};

type Section = fn(&Bench) -> Result<Part>;

const SECTIONS: &[(&str, Section)] = &[
    ("operations", operations::section),
    ("filters", filters::section),
    ("fading", fading::section),
    ("feedback", feedback::section),
    ("tables", tables::section),
    ("second_level", second_level::section),
    ("sizes", sizes::section),
    ("targets", targets::section),
    ("uploads", uploads::section),
    ("volumes", volumes::section),
];

/// All sections, or those that are named.
fn main() -> Result<()> {
    let names = named()?;
    let gpu = gpu()?;
    let clock = GpuClock::new(&gpu);
    println!(
        "Adapter: {}, {}. Times are told by {}; each is the least of several, taken in turns, where its section names no other.",
        gpu.adapter_name(),
        // By these words `cargo xtask bench draw --write` knows which page it writes, and fails without.
        if gpu.is_processor() { "a software driver" } else { "a GPU" },
        clock.told_by()
    );
    let bench = Bench { gpu, clock };
    let mut verdicts = Vec::new();
    for (name, section) in SECTIONS {
        if names.is_empty() || names.iter().any(|named| named == name) {
            let start = Instant::now();
            let (page, of_section) = section(&bench)?;
            eprintln!("{name}: {:.0} s", start.elapsed().as_secs_f64());
            println!("\n{}", page.trim_end());
            verdicts.extend(of_section);
        }
    }
    if !verdicts.is_empty() {
        println!("\n## Verdicts\n\n{}\n", about_verdicts(bench.gpu.is_processor()));
        verdicts.iter().for_each(|verdict| println!("- {verdict}"));
    }
    Ok(())
}

fn named() -> Result<Vec<String>> {
    // Cargo itself says `--bench`.
    let names: Vec<String> =
        std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    if let Some(unknown) = names.iter().find(|name| SECTIONS.iter().all(|(known, _)| known != name)) {
        let known: Vec<&str> = SECTIONS.iter().map(|(name, _)| *name).collect();
        bail!("no section is called '{unknown}'; there are: {}", known.join(", "));
    }
    Ok(names)
}

fn about_verdicts(of_processor: bool) -> &'static str {
    if of_processor {
        "What is asked is asked of a GPU. This adapter is a software driver, so these verdicts say nothing of any GPU; they are here so that \
         the lines are known to be printed."
    } else {
        "One for each thing that is asked of a GPU."
    }
}
