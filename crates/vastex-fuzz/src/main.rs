//! Fuzzes one target without coverage, or reads one input again: what `cargo xtask campaign fuzz` calls.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use vastex_fuzz::{Harm, Limit, PATIENCE, TARGETS, Target, run};

const HELP: &str = "\
Usage: vastex-fuzz TARGET [--minutes M | --cases N] [--seed S]
       vastex-fuzz TARGET --replay FILE
       vastex-fuzz TARGET --seeds DIR     writes the sound inputs, for a fuzzer to start from";

fn main() -> ExitCode {
    match fuzz(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn fuzz(arguments: &[String]) -> Result<()> {
    let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    let Some((name, options)) = arguments.split_first() else {
        bail!("{HELP}\n\nTargets: {}", names.join(", "));
    };
    let target = Target::named(name).with_context(|| format!("no target '{name}': {}", names.join(", ")))?;
    let (mut limit, mut seed) = (Limit::Cases(10_000), 1);
    let mut options = options.iter();
    while let Some(option) = options.next() {
        let value = options.next().with_context(|| format!("{option} needs a value\n\n{HELP}"))?;
        match option.as_str() {
            "--minutes" => limit = Limit::Time(Duration::from_secs_f64(60.0 * value.parse::<f64>()?)),
            "--cases" => limit = Limit::Cases(value.parse()?),
            "--seed" => seed = value.parse()?,
            "--replay" => {
                target.check(&std::fs::read(value).with_context(|| value.clone())?);
                println!("{name}: {value} passes");
                return Ok(());
            }
            "--seeds" => return write_seeds(target, &PathBuf::from(value)),
            _ => bail!("unknown option {option}\n\n{HELP}"),
        }
    }
    let ran = run(target, seed, limit, PATIENCE)?;
    let Some(failure) = ran.failed else {
        println!("{name}: {} cases passed", ran.cases);
        return Ok(());
    };
    let case = failure.case;
    let path = std::env::temp_dir().join(format!("vastex-fuzz-{name}-{seed}-{case}"));
    std::fs::write(&path, failure.input).with_context(|| path.display().to_string())?;
    let what = match failure.harm {
        Harm::Panics => "failed",
        Harm::Hangs => "does not come to an end",
    };
    bail!("{name}: case {case} of seed {seed} {what}; `vastex-fuzz {name} --replay {}`", path.display());
}

fn write_seeds(target: &Target, directory: &PathBuf) -> Result<()> {
    std::fs::create_dir_all(directory)?;
    for (n, seed) in target.seeds()?.iter().enumerate() {
        std::fs::write(directory.join(format!("seed-{n}")), seed)?;
    }
    Ok(())
}
