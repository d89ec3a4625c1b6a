//! `cargo xtask bench fetch`: what reading and decoding a tile costs beside what cannot be avoided, and direct reads.
//!
//! The measuring itself is a benchmark of vastex-tiles; here it is run and its figures are kept.

use anyhow::{Context, Result};

use crate::shell::{self, Usage};

const REPORT: &str = "docs/bench-fetch.md";

pub(crate) fn bench(options: &[&str]) -> Result<()> {
    let write = match options {
        [] => false,
        ["--write"] => true,
        [other, ..] => return Err(Usage(format!("bench fetch has no option '{other}'")).into()),
    };
    let mut command = shell::cargo("bench");
    let figures = shell::output(command.args(["--quiet", "-p", "vastex-tiles", "--bench", "fetch"]))?;
    println!("{figures}");
    if write {
        let page = format!(
            "# Fetching tiles: a container beside bare reads and decoders\n\n\
             Written by `cargo xtask bench fetch --write`. A read of a container is the look-up, the positioned read into\n\
             fresh memory, and the checksum; the bare read is the positioned read into fresh memory alone.\n\n\
             The second table is of tiles that the system's cache does not hold (on Linux alone): dropped from it before each\n\
             turn, and read by so many threads, through the cache or directly with as many reads in flight.\n\n{figures}"
        );
        let path = shell::root().join(REPORT);
        std::fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {REPORT}");
    }
    Ok(())
}
