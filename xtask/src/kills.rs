//! `cargo xtask campaign kills`: a build killed at as many moments as are asked for, each time resumed and
//! compared.
//!
//! The killing is a test of the program; this only says how often.

use anyhow::{Context, Result};

use crate::shell::{self, Usage};

/// What `cargo xtask test` does, ten times over.
const DEFAULT_COUNT: u64 = 200;

pub(crate) fn run(options: &[&str]) -> Result<()> {
    let count = parse(options)?;
    println!("{count} builds, each killed one to three times and resumed");
    let mut test = shell::cargo("test");
    test.args(["-p", "vastex-cli", "--test", "program", "a_killed_build_resumes", "--", "--nocapture"]);
    shell::run(test.env("VASTEX_KILLS", count.to_string())).context("a resumed build has other bytes")
}

fn parse(options: &[&str]) -> Result<u64> {
    let count = match options {
        [] => Some(DEFAULT_COUNT),
        ["--count", number] => number.parse().ok().filter(|count| (1..=1_000_000).contains(count)),
        _ => None,
    };
    Ok(count.ok_or_else(|| Usage("campaign kills takes --count N, with N from 1 to 1000000".to_owned()))?)
}
