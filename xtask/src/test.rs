//! `cargo xtask test`: the whole suite as a list of steps, each timed, with a table at the end.
//!
//! A step that fails does not keep the later ones from running, so that one run shows all that is wrong.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::shell::Usage;
use crate::{setup, shell, wasm, window};

/// How a step ended that did not fail.
pub(crate) enum Outcome {
    Passed,
    /// It could not run on this machine; the reason is printed in the table.
    Skipped(String),
}

struct Step {
    name: &'static str,
    what: &'static str,
    run: fn() -> Result<Outcome>,
}

const STEPS: &[Step] = &[
    Step { name: "setup", what: "what the machine must have", run: set_up },
    Step { name: "format", what: "rustfmt would change nothing", run: format },
    Step { name: "clippy", what: "no lint fires anywhere", run: clippy },
    Step { name: "docs", what: "every link in the documentation leads somewhere", run: docs },
    Step { name: "tests", what: "every test, example and invariant", run: tests },
    Step { name: "window", what: "the program's window opens", run: window::check },
    Step { name: "wasm", what: "the crates of the browser compile for it", run: wasm::check },
];

/// Runs the steps named, or all.
pub(crate) fn run(names: &[&str]) -> Result<()> {
    if let Some(unknown) = names.iter().find(|name| STEPS.iter().all(|step| step.name != **name)) {
        let known: Vec<&str> = STEPS.iter().map(|step| step.name).collect();
        return Err(Usage(format!("no step is called '{unknown}'; there are: {}", known.join(", "))).into());
    }
    let mut rows = Vec::new();
    for step in STEPS.iter().filter(|step| names.is_empty() || names.contains(&step.name)) {
        println!("\n== {}: {} ==", step.name, step.what);
        let start = Instant::now();
        let result = (step.run)();
        let time = start.elapsed();
        if let Err(error) = &result {
            eprintln!("error: {error:#}");
        }
        println!("== {} took {} ==", step.name, seconds(time));
        rows.push((step.name, time, result));
    }
    summarise(&rows)
}

fn summarise(rows: &[(&str, Duration, Result<Outcome>)]) -> Result<()> {
    println!("\n{:<8} {:>9}  result", "step", "time");
    for (name, time, result) in rows {
        let result = match result {
            Ok(Outcome::Passed) => "ok".to_owned(),
            Ok(Outcome::Skipped(why)) => format!("SKIPPED: {why}"),
            Err(error) => format!("FAILED: {}", start_of(&error.to_string())),
        };
        println!("{name:<8} {:>9}  {result}", seconds(*time));
    }
    println!("{:<8} {:>9}", "all", seconds(rows.iter().map(|(_, time, _)| *time).sum()));
    let failed: Vec<&str> =
        rows.iter().filter(|(_, _, result)| result.is_err()).map(|(name, _, _)| *name).collect();
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    Ok(())
}

/// As much of a message as a table has room for; the whole stands where the step ended.
fn start_of(message: &str) -> String {
    const ROOM: usize = 80;
    let start: String = message.chars().take(ROOM).collect();
    if start.len() < message.len() { format!("{start} ...") } else { start }
}

fn seconds(time: Duration) -> String {
    format!("{:.1} s", time.as_secs_f64())
}

fn set_up() -> Result<Outcome> {
    setup::ensure_component("fmt", "rustfmt")?;
    setup::ensure_component("clippy", "clippy")?;
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    Ok(Outcome::Passed)
}

fn format() -> Result<Outcome> {
    shell::run(shell::cargo("fmt").args(["--all", "--check"])).map(|()| Outcome::Passed)
}

fn clippy() -> Result<Outcome> {
    let mut command = shell::cargo("clippy");
    shell::run(command.args(["--workspace", "--all-targets", "--", "-D", "warnings"]))
        .map(|()| Outcome::Passed)
}

/// Of the libraries only: the program `vastex` and the crate `vastex` would write to the same place.
fn docs() -> Result<Outcome> {
    let mut command = shell::cargo("doc");
    command.env("RUSTDOCFLAGS", "-D warnings");
    shell::run(command.args(["--workspace", "--lib", "--no-deps"])).map(|()| Outcome::Passed)
}

/// One invocation for the whole workspace, so that features unify and nothing is compiled twice.
fn tests() -> Result<Outcome> {
    let mut command = shell::cargo("test");
    // The suite is the same sample each time; campaigns take others.
    command.env("PROPTEST_RNG_SEED", "1").args(["--workspace", "--no-fail-fast"]);
    shell::run(&mut command).map(|()| Outcome::Passed)
}
