//! `cargo xtask bench fetch | slow | decide | draw`: the benchmarks that are crates' own, run, and their
//! figures kept.
//!
//! What is measured, and beside what, is theirs; here stand the commands and the pages of docs/.

use std::path::PathBuf;
use std::process::Stdio;

use anyhow::{Context, Result};

use crate::shell::{self, Usage};
use crate::{demo, demo_program, measure, setup};

/// What is read from a cold disk: the real Earth, each tile where the disk can read it directly.
const EARTH: [&str; 7] =
    ["build", "assets/earth-color-10800x5400.jpg", "--align", "4K", "--page", "120", "--compress=none"];

/// A benchmark of a crate, which prints its figures as a part of a page.
pub(crate) struct Figures {
    pub(crate) name: &'static str,
    /// Of which packages cargo is to build: features follow from it.
    packages: &'static [&'static str],
    /// The profile that it is built with.
    profile: &'static str,
    report: &'static str,
    /// Where figures of a GPU go, if not into the report, which has those of a software driver.
    gpu_report: Option<&'static str>,
    /// True if it is given a container of the real Earth.
    reads_earth: bool,
    introduction: &'static str,
    /// True if parts of it may be run alone, by their names.
    sections: bool,
}

pub(crate) const FETCH: Figures = Figures {
    name: "fetch",
    packages: &["-p", "vastex-tiles"],
    profile: "bench",
    report: "docs/bench-fetch.md",
    gpu_report: None,
    reads_earth: true,
    introduction: "\
# Fetching tiles: a container beside bare reads and decoders

Written by `cargo xtask bench fetch --write`. A read of a container is the look-up, the positioned read into
fresh memory, and the checksum; the bare read is the positioned read into fresh memory alone.

The second table is of tiles of the real Earth that the system's cache does not hold (on Linux alone): they are dropped from it before each
turn, and read in no order, through the cache by so many threads of a loader, or directly (`--direct`). Of a container that is read
directly so many reads go on at once as it was opened for, by as many threads, whatever number the loader was told to have; each thread
reads and decodes a tile, and no others stand behind it.

A ratio is the median of the turns' ratios, which is not that of the medians; a processor time is told to hundredths of a second for all
tiles of a turn. A container is opened with 8 reads at once by default. Until the loader's threads did direct reads, threads of the store's own
stood behind them: beside buffered reads that was 1.31 times as fast with one read at once (the store read a tile while the loader decoded
another) and 0.95 to 1.15 times with 2 to 32, for 90 to 130 us of processor time a tile (medians of three runs).
",
    sections: false,
};

pub(crate) const SLOW: Figures = Figures {
    name: "slow",
    packages: &["-p", "vastex-tiles"],
    profile: "bench",
    report: "docs/bench-slow.md",
    gpu_report: None,
    reads_earth: false,
    introduction: "\
# Slow sources: what a disk cache is worth

Written by `cargo xtask bench slow --write`. The source makes its tiles in memory and is slowed on purpose; the cache is
[the disk tier](disk-cache.md), on the disk that the crates are built on. A later run opens the cache anew and reads the same pages.
",
    sections: false,
};

pub(crate) const DECIDE: Figures = Figures {
    name: "decide",
    packages: &["-p", "vastex-core"],
    profile: "bench",
    report: "docs/bench-decide.md",
    gpu_report: None,
    reads_earth: false,
    introduction: "\
# Deciding: what a frame's decisions cost on one core

Written by `cargo xtask bench decide --write`, the plots too. No GPU and no disk have a part in it; both sides of a comparison
take turns. Asked for is a decision under 500 µs with 10,000 resident and 2,000 wanted pages. Tests hold that a frame allocates
nothing in the steady state (`crates/vastex-core/tests/steady.rs`), and how soon a view is complete after a cut (`suite/views.rs` beside it).
",
    sections: false,
};

pub(crate) const TEXTURES: Figures = Figures {
    name: "textures",
    packages: &["-p", "vastex"],
    profile: "bench",
    report: "docs/bench-textures.md",
    gpu_report: None,
    reads_earth: false,
    introduction: "\
# Many textures: what 200 of them cost the thread that draws

Written by `cargo xtask bench textures --write`. A wall of 200 quads, each with a texture of its own: of four channels in pages of 128 texels, of one
channel in pages of 120, and small ones that are held whole. Processor time of the calling thread for a frame, the least of five medians of 200
frames; what the adapter does is not counted, so that a software driver tells as much as a GPU.

Until bind groups were those of pools and not of textures, such a frame took 1,102 us still and 1,023 us moving (feedback 149, update 238, picture 625,
submission 90), drawn one by one, each with its own bind group, in 68 pools. Measured beside that, on the same machine and day, 2ca216b1 needed 0.40 of it one by
one and 0.25 in draws of pools: half was asked for, and a fifth hoped for. At ba68a407, in three turns with 2676eeb on a busy machine, it was 0.50 to 0.59 one by one and 0.23 to 0.38 in draws of pools. The figures below are of another day, on which everything took less, and stand for themselves.
",
    sections: false,
};

pub(crate) const DRAW: Figures = Figures {
    name: "draw",
    packages: &["--workspace"],
    profile: "bench",
    report: "docs/bench-draw.md",
    gpu_report: Some("docs/bench-draw-gpu.md"),
    reads_earth: false,
    introduction: "\
# Drawing: what a virtual texture costs beside an ordinary one

Written by `cargo xtask bench draw --write`, which needs nobody and takes a few minutes on any adapter: docs/bench-draw.md has the figures of a
software driver, docs/bench-draw-gpu.md those of a GPU. What is asked for stands with each table, is meant for a GPU at 1920x1080, and is judged at
the end, a line each. A software driver runs both sides of every branch and spends its time otherwise than a GPU would; its figures are kept for their
ratios, in smaller pictures, and its verdicts say nothing of a GPU.
",
    sections: true,
};

impl Figures {
    /// Runs the benchmark and prints its figures; with `--write`, keeps them. Of one that has sections, those
    /// that are named.
    pub(crate) fn bench(&self, options: &[&str]) -> Result<()> {
        let (write, sections) = match options {
            ["--write"] => (true, &[][..]),
            sections if self.sections && !sections.iter().any(|name| name.starts_with('-')) => {
                (false, sections)
            }
            [] => (false, &[][..]),
            [other, ..] => {
                return Err(Usage(format!("bench {} has no option '{other}'", self.name)).into());
            }
        };
        let mut command = shell::cargo("bench");
        if self.reads_earth {
            command.env("VASTEX_CONTAINER", aligned_earth()?);
        }
        if write {
            command.env("VASTEX_PLOTS", shell::root().join("docs"));
        }
        command.args(["--quiet", "--profile", self.profile]).args(self.packages);
        command.args(["--bench", self.name, "--"]).args(sections);
        // How far it is, and what is wrong.
        let figures = shell::output(command.stderr(Stdio::inherit()))?;
        println!("{figures}");
        if write {
            let report = self.report_of(&figures)?;
            let path = shell::root().join(report);
            std::fs::write(&path, format!("{}\n{}\n{figures}", self.introduction, measure::stamp()?))
                .with_context(|| format!("cannot write {}", path.display()))?;
            println!("written to {report}");
        }
        Ok(())
    }
}

impl Figures {
    /// The page that these figures go to. Where there are two, the benchmark says in the line about its
    /// adapter which kind of driver that is; figures without such a line are an error, lest they go to the
    /// wrong page.
    fn report_of(&self, figures: &str) -> Result<&'static str> {
        let Some(gpu_report) = self.gpu_report else { return Ok(self.report) };
        let says = |kind: &str| figures.lines().any(|line| line.contains(kind));
        match (says("), a GPU. "), says("), a software driver. ")) {
            (true, false) => Ok(gpu_report),
            (false, true) => Ok(self.report),
            _ => anyhow::bail!(
                "the figures of bench {} do not say whether they are of a GPU or of a software driver, so nothing was written: \
                 apps/scenes/benches/draw/main.rs prints it in the line of the adapter",
                self.name
            ),
        }
    }
}

/// Makes the container, unless it is there already, by the program as the demo compiles it.
fn aligned_earth() -> Result<PathBuf> {
    let directory = shell::root().join("target/bench");
    let path = directory.join("earth-aligned.vastex");
    if !path.exists() {
        setup::ensure(&setup::C_COMPILER)?;
        setup::ensure_if_possible(&setup::NASM);
        std::fs::create_dir_all(&directory)
            .with_context(|| format!("cannot create {}", directory.display()))?;
        let mut compile = shell::cargo("build");
        shell::run(compile.args(["-p", "vastex-cli"]).args(demo_program::features(false)))?;
        shell::run(demo::vastex().args(EARTH).arg("-o").arg(&path))?;
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_go_to_the_page_of_their_kind_of_driver_or_nowhere() {
        let of = |kind: &str| DRAW.report_of(&format!("Adapter: Some (vulkan), {kind}. Times are told.\n"));
        assert_eq!(of("a GPU").unwrap(), "docs/bench-draw-gpu.md");
        assert_eq!(of("a software driver").unwrap(), "docs/bench-draw.md");
        let refused = of("a card").unwrap_err().to_string();
        assert!(refused.contains("bench draw") && refused.contains("nothing was written"), "{refused}");
        assert_eq!(SLOW.report_of("").unwrap(), SLOW.report);
    }
}
