//! `cargo xtask campaign flips | fuzz`: more damaged files than the suite has time for.
//!
//! Flips are a test of vastex-tiles. Fuzzing is cargo-fuzz's, guided by coverage; that and a nightly compiler
//! are installed where they are missing. Where they cannot be had it is vastex-fuzz's own, from a seed that
//! each run takes from the clock and prints.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};

use crate::shell::{self, Usage};

/// What `cargo xtask test` does, ten times over.
const DEFAULT_FLIPS: u64 = 10_000;
const DEFAULT_MINUTES: u64 = 30;
/// As vastex-fuzz names them.
const TARGETS: &[&str] = &[
    "container",
    "part",
    "image",
    "profile",
    "raw",
    "mosaic",
    "deep_zoom",
    "gaia_sky",
    "celestia",
    "prototype",
    "export",
    "volume",
];

pub(crate) fn flips(options: &[&str]) -> Result<()> {
    let count = match options {
        [] => Some(DEFAULT_FLIPS),
        ["--count", number] => number.parse().ok().filter(|count| (1..=1_000_000_000).contains(count)),
        _ => None,
    };
    let count = count.ok_or_else(|| Usage("campaign flips takes --count N, from 1 to 10^9".to_owned()))?;
    println!("{count} flipped bits");
    let mut test = shell::cargo("test");
    test.args(["-p", "vastex-tiles", "--lib", "a_flipped_bit", "--", "--nocapture"]);
    shell::run(test.env("VASTEX_FLIPS", count.to_string())).context("a flipped bit did harm")
}

pub(crate) fn fuzz(options: &[&str]) -> Result<()> {
    let (minutes, targets) = parse(options)?;
    let guided = match ensure_cargo_fuzz() {
        Ok(()) => true,
        Err(error) => {
            println!("going on without guidance by coverage, from a seed: {error:#}");
            false
        }
    };
    for target in targets {
        println!("\n{target}: {minutes} minutes");
        let mut fuzzer =
            if guided { with_coverage(target, minutes)? } else { without_coverage(target, minutes)? };
        shell::run(&mut fuzzer)
            .with_context(|| format!("{target}: an input did harm; keep it as a regression"))?;
    }
    Ok(())
}

/// Installs cargo-fuzz, and the nightly compiler that it needs, where they are missing. The error names the
/// command that failed.
fn ensure_cargo_fuzz() -> Result<()> {
    /// What does not start, the program that brings it, and its arguments.
    const NEEDS: [([&str; 2], &str, &[&str]); 2] = [
        (["+nightly", "--version"], "rustup", &["toolchain", "install", "nightly", "--profile", "minimal"]),
        (["fuzz", "--version"], "cargo", &["install", "cargo-fuzz", "--locked"]),
    ];
    for (needed, program, arguments) in NEEDS {
        let starts = || shell::succeeds(shell::command("cargo").args(needed));
        if starts() {
            continue;
        }
        let installs = format!("{program} {}", arguments.join(" "));
        println!("`cargo {}` does not start, and the fuzzer is guided by it: {installs}", needed[0]);
        shell::run(shell::command(program).args(arguments))
            .with_context(|| format!("`{installs}` failed; please install cargo-fuzz by that"))?;
        ensure!(starts(), "`cargo {}` does not start after `{installs}`", needed[0]);
    }
    Ok(())
}

/// Starts from the sound inputs, and from what earlier campaigns found worth keeping.
fn with_coverage(target: &str, minutes: u64) -> Result<Command> {
    let corpus = format!("fuzz/corpus/{target}");
    shell::run(own_fuzzer().args([target, "--seeds", &corpus]))?;
    let mut command = shell::command("cargo");
    command.args(["+nightly", "fuzz", "run", target, "--"]);
    command.args([format!("-max_total_time={}", minutes * 60).as_str(), "-max_len=131072", "-timeout=60"]);
    // Threads of a pool end a moment after the pool, so what they still hold then looks leaked.
    command.arg("-detect_leaks=0");
    // mozjpeg defines the same constants in several of its files.
    command.env("ASAN_OPTIONS", "detect_odr_violation=0");
    Ok(command)
}

fn without_coverage(target: &str, minutes: u64) -> Result<Command> {
    let seed = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs();
    let mut command = own_fuzzer();
    command.args([target, "--minutes", &minutes.to_string(), "--seed", &seed.to_string()]);
    Ok(command)
}

fn own_fuzzer() -> Command {
    let mut command = shell::cargo("run");
    command.args(["--quiet", "-p", "vastex-fuzz", "--"]);
    command
}

fn parse(options: &[&str]) -> Result<(u64, Vec<&'static str>)> {
    let (mut minutes, mut targets) = (DEFAULT_MINUTES, TARGETS.to_vec());
    for option in options.chunks(2) {
        match option {
            ["--minutes", number] => {
                let given = number.parse().ok().filter(|minutes| (1..=100_000).contains(minutes));
                minutes = given.ok_or_else(|| Usage("--minutes takes 1 to 100000".to_owned()))?;
            }
            ["--target", name] => {
                targets.retain(|target| target == name);
                if targets.is_empty() {
                    return Err(Usage(format!("the targets are: {}", TARGETS.join(", "))).into());
                }
            }
            _ => return Err(Usage("campaign fuzz takes --minutes M and --target T".to_owned()).into()),
        }
    }
    Ok((minutes, targets))
}
