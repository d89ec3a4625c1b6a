//! `cargo xtask campaign`: the random tests with ever more cases, for as long as they are given.
//!
//! Each round doubles the number of simulated worlds, of property cases, of pictures by chance, of marches
//! and slices of volumes, and of cameras around real ones (`VASTEX_AROUND`); the suite itself runs a fixed,
//! small sample of each, but none of these cameras.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::shell::{self, Usage};

/// The crates whose tests are random; the others would only repeat themselves.
const CRATES: &[&str] = &["vastex-core", "vastex-tiles", "vastex-build"];
/// The crate of the scenes, and the test of it that is random.
const PICTURES: [&str; 2] = ["vastex-scenes", "matrix::"];
/// The crate that draws volumes by chance.
const VOLUMES: &str = "vastex-viewer";
/// Its tests that draw marches and slices through a volume of 10^15 voxels, and real volumes from anywhere.
const MARCHES: [&str; 2] = ["are_the_formula", "in_perspective_is_the_reference"];
const DEFAULT_MINUTES: u64 = 10;
const FIRST_WORLDS: u64 = 10_000;
const FIRST_CASES: u64 = 2048;
const FIRST_PICTURES: u64 = 100;
const FIRST_MARCHES: u64 = 10;
/// Slices for each march: they take a fraction of its time.
const SLICES_A_MARCH: u64 = 20;

pub(crate) fn run(options: &[&str]) -> Result<()> {
    let budget = parse(options)?;
    let mut build = shell::cargo("test");
    shell::run(packages(&mut build).arg("--no-run"))?;
    let mut build = shell::cargo("test");
    shell::run(pictures(&mut build).arg("--no-run"))?;
    let mut build = shell::cargo("test");
    shell::run(marches(&mut build).arg("--no-run"))?;
    let start = Instant::now();
    for round in 0..32 {
        let round_start = Instant::now();
        run_round(round)?;
        let (last, spent) = (round_start.elapsed(), start.elapsed());
        println!("round {} passed in {:.0} s", round + 1, last.as_secs_f64());
        if spent + 2 * last > budget {
            println!("the next round would not fit into what is left of {} minutes", budget.as_secs() / 60);
            break;
        }
    }
    Ok(())
}

fn run_round(round: u32) -> Result<()> {
    let (worlds, cases, drawn) = (FIRST_WORLDS << round, FIRST_CASES << round, FIRST_PICTURES << round);
    let marches_drawn = FIRST_MARCHES << round;
    println!(
        "\nround {}: {worlds} worlds, {cases} cases of each property, {drawn} pictures, {marches_drawn} marches",
        round + 1
    );
    let mut test = shell::cargo("test");
    packages(&mut test).env("VASTEX_WORLDS", worlds.to_string()).env("PROPTEST_CASES", cases.to_string());
    let fault = || format!("round {} found a fault; the test's output says which case", round + 1);
    shell::run(&mut test).with_context(fault)?;
    let mut test = shell::cargo("test");
    pictures(&mut test).arg(PICTURES[1]).env("VASTEX_PICTURES", drawn.to_string());
    shell::run(&mut test).with_context(fault)?;
    let mut test = shell::cargo("test");
    let slices_drawn = SLICES_A_MARCH * marches_drawn;
    marches(&mut test).arg("--").args(MARCHES).env("VASTEX_MARCHES", marches_drawn.to_string());
    test.env("VASTEX_SLICES", slices_drawn.to_string()).env("VASTEX_AROUND", marches_drawn.to_string());
    shell::run(&mut test).with_context(fault)
}

fn packages(command: &mut std::process::Command) -> &mut std::process::Command {
    for name in CRATES {
        command.args(["-p", name]);
    }
    command.args(["--lib", "--tests"])
}

fn pictures(command: &mut std::process::Command) -> &mut std::process::Command {
    command.args(["-p", PICTURES[0], "--test", "scenes"])
}

fn marches(command: &mut std::process::Command) -> &mut std::process::Command {
    command.args(["-p", VOLUMES, "--test", "suite"])
}

fn parse(options: &[&str]) -> Result<Duration> {
    let minutes = match options {
        [] => Some(DEFAULT_MINUTES),
        ["--minutes", number] => number.parse().ok().filter(|minutes| (1..=100_000).contains(minutes)),
        _ => None,
    };
    let minutes =
        minutes.ok_or_else(|| Usage("campaign takes --minutes N, with N from 1 to 100000".to_owned()))?;
    Ok(Duration::from_secs(minutes * 60))
}
