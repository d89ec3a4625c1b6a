//! `cargo xtask bench fetch | slow | decide | draw`: the benchmarks that are crates' own, run, and their figures kept.
//!
//! What is measured, and beside what, is theirs; here stand the commands and the pages of docs/.

use anyhow::{Context, Result};

use crate::shell::{self, Usage};

/// A benchmark of a crate, which prints its figures as a part of a page.
pub(crate) struct Figures {
    pub(crate) name: &'static str,
    package: &'static str,
    /// The profile that it is built with.
    profile: &'static str,
    report: &'static str,
    introduction: &'static str,
}

pub(crate) const FETCH: Figures = Figures {
    name: "fetch",
    package: "vastex-tiles",
    profile: "bench",
    report: "docs/bench-fetch.md",
    introduction: "\
# Fetching tiles: a container beside bare reads and decoders

Written by `cargo xtask bench fetch --write`. A read of a container is the look-up, the positioned read into
fresh memory, and the checksum; the bare read is the positioned read into fresh memory alone.

The second table is of tiles that the system's cache does not hold (on Linux alone): dropped from it before each
turn, and read by so many threads, through the cache or directly with as many reads in flight.
",
};

pub(crate) const SLOW: Figures = Figures {
    name: "slow",
    package: "vastex-tiles",
    profile: "bench",
    report: "docs/bench-slow.md",
    introduction: "\
# Slow sources: what a disk cache is worth

Written by `cargo xtask bench slow --write`. The source makes its tiles in memory and is slowed on purpose; the cache is
[the disk tier](disk-cache.md), on the disk that the crates are built on. A later run opens the cache anew and reads the same pages.
",
};

pub(crate) const DECIDE: Figures = Figures {
    name: "decide",
    package: "vastex-core",
    profile: "bench",
    report: "docs/bench-decide.md",
    introduction: "\
# Deciding: what a frame's decisions cost on one core

Written by `cargo xtask bench decide --write`, the plots too. No GPU and no disk have a part in it; both sides of a comparison
take turns. Asked for is a decision under 500 µs with 10,000 resident and 2,000 wanted pages. Tests hold that a frame allocates
nothing in the steady state (`crates/vastex-core/tests/steady.rs`), and how soon a view is complete after a cut (`suite/views.rs` beside it).
",
};

pub(crate) const DRAW: Figures = Figures {
    name: "draw",
    package: "vastex-scenes",
    // What is measured runs on the GPU, for which the suite's build will do.
    profile: "dev",
    report: "docs/bench-draw.md",
    introduction: "\
# Drawing: what a virtual texture costs beside an ordinary one

Written by `cargo xtask bench draw --write`, in a minute or two. What is asked for stands with each table, and is meant for a GPU
at 1920x1080. A software driver runs both sides of every branch and spends its time otherwise than a GPU would; its figures are here for
their ratios, in smaller pictures.
",
};

impl Figures {
    /// Runs the benchmark and prints its figures; with `--write`, keeps them.
    pub(crate) fn bench(&self, options: &[&str]) -> Result<()> {
        let write = match options {
            [] => false,
            ["--write"] => true,
            [other, ..] => {
                return Err(Usage(format!("bench {} has no option '{other}'", self.name)).into());
            }
        };
        let mut command = shell::cargo("bench");
        if write {
            command.env("VASTEX_PLOTS", shell::root().join("docs"));
        }
        let figures = shell::output(command.args([
            "--quiet",
            "--profile",
            self.profile,
            "-p",
            self.package,
            "--bench",
            self.name,
        ]))?;
        println!("{figures}");
        if write {
            let path = shell::root().join(self.report);
            std::fs::write(&path, format!("{}\n{figures}", self.introduction))
                .with_context(|| format!("cannot write {}", path.display()))?;
            println!("written to {}", self.report);
        }
        Ok(())
    }
}
