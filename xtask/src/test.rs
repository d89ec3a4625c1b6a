//! `cargo xtask test`: the whole suite as a list of steps, each timed, with a table at the end; or the tests
//! of one crate.
//!
//! A step that fails does not keep the later ones from running, so that one run shows all that is wrong.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::outcome::{Outcome, SEED, cargo_test};
use crate::shell::Usage;
use crate::{browser, drivers, facade_docs, once, setup, shaders, shell, test_programs, wasm, web, window};

struct Step {
    name: &'static str,
    what: &'static str,
    run: fn() -> Result<Outcome>,
}

const STEPS: &[Step] = &[
    Step { name: "setup", what: "what the machine must have", run: set_up },
    Step { name: "format", what: "rustfmt would change nothing", run: format },
    Step { name: "clippy", what: "no lint fires anywhere", run: clippy },
    Step {
        name: "docs",
        what: "every link in the documentation leads somewhere, and that of vastex stays there",
        run: docs,
    },
    Step { name: "tests", what: "every test, example and invariant", run: tests },
    Step { name: "drivers", what: "a second driver draws the same", run: drivers::check },
    Step { name: "window", what: "the program's window opens", run: window::check },
    Step {
        name: "shaders",
        what: "every shader is WGSL, and every one that a test or the window used is known",
        run: shaders::check,
    },
    Step {
        name: "browser",
        what: "a browser takes the shaders that were used, a part of the others, and pipelines of every kind",
        run: browser::check,
    },
    Step { name: "wasm", what: "the crates of the browser compile for it", run: wasm::check },
    Step { name: "web", what: "a browser draws volumes as they are drawn natively", run: web::check },
];

/// Runs the steps named, or all; or, after `-p`, the tests of a crate.
pub(crate) fn run(names: &[&str]) -> Result<()> {
    if let ["-p" | "--package", names @ ..] = names {
        return one_crate(names);
    }
    if let Some(unknown) = names.iter().find(|name| STEPS.iter().all(|step| step.name != **name)) {
        let known: Vec<&str> = STEPS.iter().map(|step| step.name).collect();
        return Err(Usage(format!("no step is called '{unknown}'; there are: {}", known.join(", "))).into());
    }
    let mut rows = Vec::new();
    for step in STEPS.iter().filter(|step| names.is_empty() || names.contains(&step.name)) {
        println!("\n== {}: {} ==", step.name, step.what);
        let start = Clock::now();
        let result = (step.run)();
        let time = start.elapsed();
        if let Err(error) = &result {
            eprintln!("error: {error:#}");
        }
        println!("== {} took {} ==", step.name, seconds(time.wall));
        rows.push((step.name, time, result));
    }
    summarise(&rows)
}

/// The tests of one crate, or those of them whose names contain a word.
fn one_crate(names: &[&str]) -> Result<()> {
    let known = crates()?;
    let (name, filter) = match names {
        [name] => (*name, None),
        [name, filter] => (*name, Some(*filter)),
        _ => {
            return Err(Usage(format!(
                "-p takes a crate and perhaps a word; there are: {}",
                known.join(", ")
            ))
            .into());
        }
    };
    if !known.iter().any(|known| known == name) {
        return Err(Usage(format!("no crate is called '{name}'; there are: {}", known.join(", "))).into());
    }
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    let mut command = cargo_test();
    command.args(["-p", name]).args(filter);
    shell::run(&mut command)
}

/// The names of the packages of the workspace.
fn crates() -> Result<Vec<String>> {
    let mut names = vec!["xtask".to_owned()];
    for folder in ["crates", "apps"] {
        for entry in fs::read_dir(shell::root().join(folder))? {
            let manifest = fs::read_to_string(entry?.path().join("Cargo.toml"))?;
            let name = manifest.lines().find_map(|line| line.strip_prefix("name = "));
            names.extend(name.map(|name| name.trim_matches('"').to_owned()));
        }
    }
    names.sort();
    Ok(names)
}

/// When something began, by the clock and by the processor time of the programs that have ended since.
struct Clock {
    wall: Instant,
    processor: Option<Duration>,
}

/// How long something took.
#[derive(Clone, Copy, Debug)]
struct Time {
    wall: Duration,
    /// Of all processors together; unknown where the system does not say.
    processor: Option<Duration>,
}

impl Clock {
    fn now() -> Clock {
        Clock { wall: Instant::now(), processor: shell::processor_time() }
    }

    fn elapsed(&self) -> Time {
        let processor =
            shell::processor_time().zip(self.processor).map(|(now, then)| now.saturating_sub(then));
        Time { wall: self.wall.elapsed(), processor }
    }
}

fn summarise(rows: &[(&str, Time, Result<Outcome>)]) -> Result<()> {
    println!("\n{:<8} {:>9} {:>10}  result", "step", "time", "processor");
    let processor = |time: Option<Duration>| time.map_or_else(|| "-".to_owned(), seconds);
    for (name, time, result) in rows {
        let result = match result {
            Ok(Outcome::Passed) => "ok".to_owned(),
            Ok(Outcome::Skipped(why)) => format!("SKIPPED: {why}"),
            Err(error) => format!("FAILED: {}", start_of(&error.to_string())),
        };
        println!("{name:<8} {:>9} {:>10}  {result}", seconds(time.wall), processor(time.processor));
    }
    let all = rows.iter().map(|(_, time, _)| time.wall).sum();
    let all_processor = rows.iter().map(|(_, time, _)| time.processor).sum();
    println!("{:<8} {:>9} {:>10}", "all", seconds(all), processor(all_processor));
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
    setup::ensure_if_possible(&setup::NASM);
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    Ok(Outcome::Passed)
}

fn format() -> Result<Outcome> {
    shell::run(shell::cargo("fmt").args(["--all", "--check"])).map(|()| Outcome::Passed)
}

fn clippy() -> Result<Outcome> {
    if once::is_asked_for() {
        return once::lint().map(|()| Outcome::Passed);
    }
    let mut command = shell::cargo("clippy");
    shell::run(command.args(["--workspace", "--all-targets", "--", "-D", "warnings"]))
        .map(|()| Outcome::Passed)
}

/// Where Linux tells of NVIDIA's driver. A program may hang in it whose threads end while others make and
/// drop devices, and each test has a thread of its own: with 16 at once the tests of vastex-wgpu hung in two
/// runs of three (580.159, an H100), and in none where each had the program to itself.
const NVIDIA_DRIVER: &str = "/proc/driver/nvidia/version";

/// Of the libraries only: the program `vastex` and the crate `vastex` would write to the same place.
fn docs() -> Result<Outcome> {
    let pages = shell::target_dir().join("doc");
    if once::is_asked_for() {
        once::document(&pages)?;
    } else {
        let mut command = shell::cargo("doc");
        command.env("RUSTDOCFLAGS", "-D warnings");
        shell::run(command.args(["--workspace", "--lib", "--no-deps"]))?;
    }
    facade_docs::check(&pages.join("vastex"))?;
    Ok(Outcome::Passed)
}

fn tests() -> Result<Outcome> {
    shaders::forget()?;
    let log = shaders::handed_over();
    let in_turn = Path::new(NVIDIA_DRIVER).exists();
    if in_turn {
        println!("the tests of each program run one after the other: {NVIDIA_DRIVER} is there");
    }
    test_programs::run(|command| {
        command.env(shaders::LOG, &log).env("PROPTEST_RNG_SEED", SEED);
        if in_turn {
            command.env("RUST_TEST_THREADS", "1");
        }
    })?;
    Ok(Outcome::Passed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crates_are_those_of_the_workspace() {
        let crates = crates().unwrap();
        for name in ["vastex", "vastex-cli", "vastex-core", "vastex-scenes", "xtask"] {
            assert!(crates.iter().any(|known| known == name), "{name} of {crates:?}");
        }
    }

    #[test]
    fn processor_time_is_that_of_programs_which_have_ended() {
        if !cfg!(target_os = "linux") {
            return;
        }
        let clock = Clock::now();
        shell::output(shell::command("sh").args(["-c", "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"]))
            .unwrap();
        let time = clock.elapsed();
        assert!(time.processor.unwrap() > Duration::ZERO, "{time:?}");
    }
}
