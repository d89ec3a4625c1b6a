//! A part of `cargo xtask bench build`: from a PNG to levels of tiles without loss, beside the scripts that
//! Gaia Sky's makers use, which cut an image into tiles and then join four tiles at a time into each coarser
//! one.
//!
//! The scripts are fetched, never kept here; how runs are measured and compared stands in `measure`.

use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::inputs::Input;
use crate::measure::{self, Run, median, medians};
use crate::{python, shell};

/// Where the scripts come from.
const REPOSITORY: &str = "https://codeberg.org/langurmonkey/virtualtexture-tools";
/// Where a copy of them is that need not be fetched.
const TOOLS_VARIABLE: &str = "VASTEX_GAIA_SKY_TOOLS";
/// The speed that a build must have beside the scripts.
const LEAST_SPEED: f64 = 8.0;
/// What was measured by hand beside it.
const OTHERS: &str = "
What encoders and decoders take, measured apart (processor time on another machine than that of the table above; 29 MiB of the tiles of
level 0, all 384 MiB of rows of the PNG):

| LZ4 of tiles of 136x136 texels | ms / MiB | bytes |
|---|---|---|
| texel by texel, as colours with alpha of 8 bits are encoded | 0.60 | 1.01 |
| lz4_flex, as all other tiles are | 0.80 | 1.00 |
| C's lz4 | 0.76 | 0.99 |
| C's lz4, acceleration 2 | 0.67 | 1.02 |
| C's lz4, acceleration 4 | 0.63 | 1.04 |
| C's lz4, acceleration 16 | 0.49 | 1.18 |

| inflating the PNG | s |
|---|---|
| fdeflate, which is used | 0.45 |
| zlib-rs | 0.46 |

Of a whole build LZ4 is a third and inflating another. The encoder of our own makes the container of this image 1.4 % larger than lz4_flex does,
that of the real Earth 0.8 % smaller, and that of the mask above no other, since a mask has no colours. With it, and with memory that is used again,
a build takes 0.84 of the processor time that it took before, and 0.87 of the time; without compression 0.93 of the time.
";
/// 16384x8192 texels: 16x8 tiles of 1024, which are level 3.
const INPUT: Input = Input::Mirrored { across: 1, down: 1 };

/// A way from the image to tiles, as a shell script.
struct Way {
    name: &'static str,
    script: &'static str,
    output: &'static str,
}

/// The anchor first, then the builds, then what goes the whole way to tiles of the same kind.
const WAYS: [Way; 4] = [
    Way {
        name: "Gaia Sky's scripts, PNG tiles of 1024",
        script: r#"mkdir "$OUT" && cd "$OUT" && "$PYTHON" "$TOOLS/split-tiles.py" 1024 "$IN" -f png && mkdir level3 &&
                   mv tx_* level3 && "$PYTHON" "$TOOLS/generate-lod.py" 3 level3 -f png"#,
        output: "scripts",
    },
    Way {
        name: "`vastex build`, LZ4 (the default)",
        script: r#""$VASTEX" build "$IN" -o "$OUT""#,
        output: "png.vastex",
    },
    Way {
        name: "`vastex build --compress none`",
        script: r#""$VASTEX" build "$IN" -o "$OUT" --compress none"#,
        output: "raw.vastex",
    },
    Way {
        name: "`vastex build` and `vastex export`, the same PNG tiles",
        script: r#""$VASTEX" build "$IN" -o "$OUT.vastex" &&
                   "$VASTEX" export "$OUT.vastex" --layout gaiasky --format png --tile-size 1024 -o "$OUT""#,
        output: "exported",
    },
];
/// Those that must be fast beside the scripts.
const BUILDS: Range<usize> = 1..3;
/// Gives the script's arguments their names.
const ARGUMENTS: &str = "VASTEX=$0 PYTHON=$1 TOOLS=$2 OUT=$3 IN=$4; ";

/// Plays `runs` rounds and says what they took, for the report.
pub(crate) fn compare(directory: &Path, vastex: &Path, runs: usize) -> Result<String> {
    let (tools, python) = (tools(directory)?, python::with_packages(directory)?);
    let image = png(directory)?;
    let mut rounds: Vec<Vec<Run>> = Vec::with_capacity(runs);
    for round in 0..runs {
        println!("round {} of {runs}", round + 1);
        let run = |way: &Way| {
            let output = directory.join(way.output);
            let script = format!("{ARGUMENTS}{}", way.script);
            let paths =
                [vastex, &python, &tools, &output, &image].map(|path| path.to_string_lossy().into_owned());
            let arguments: Vec<String> = ["-c".to_owned(), script].into_iter().chain(paths).collect();
            measure::run("sh", &arguments, &output)
        };
        rounds.push(WAYS.iter().map(run).collect::<Result<_>>()?);
    }
    table(&rounds)
}

fn table(rounds: &[Vec<Run>]) -> Result<String> {
    let mut page = String::from("\n## From PNG, without loss, beside Gaia Sky's scripts\n\n");
    writeln!(
        page,
        "{}, as PNG; medians of {} interleaved runs. The scripts take the whole image into memory, need a size that the\n\
         tiles divide, and make no borders.\n\n\
         | way | wall s | CPU s | peak MB | written MB | speed / scripts |\n|---|---|---|---|---|---|",
        INPUT.name(),
        rounds.len(),
    )?;
    let speed = |index: usize| median(rounds.iter().map(|round| round[0].wall / round[index].wall).collect());
    for (index, way) in WAYS.iter().enumerate() {
        let runs: Vec<Run> = rounds.iter().map(|round| round[index]).collect();
        let Run { wall, cpu, peak_mb, written_mb } = medians(&runs);
        let speed = speed(index);
        writeln!(
            page,
            "| {} | {wall:.2} | {cpu:.2} | {peak_mb:.0} | {written_mb:.0} | {speed:.1} |",
            way.name
        )?;
    }
    page.push('\n');
    for index in BUILDS {
        let says = if speed(index) >= LEAST_SPEED { "holds" } else { "DOES NOT HOLD" };
        let (name, speed) = (WAYS[index].name, speed(index));
        writeln!(
            page,
            "- {name} at least {LEAST_SPEED:.0} times as fast as the scripts: {says} ({speed:.1})."
        )?;
    }
    page.push_str(OTHERS);
    Ok(page)
}

/// The image as a PNG, made of the TIFF unless it is there.
fn png(directory: &Path) -> Result<PathBuf> {
    let tiff = INPUT.make(directory)?;
    let png = tiff.with_extension("png");
    if !png.exists() {
        shell::run(shell::command("vips").arg("pngsave").arg(&tiff).arg(&png))?;
    }
    Ok(png)
}

/// The scripts, fetched unless they are there.
fn tools(directory: &Path) -> Result<PathBuf> {
    if let Some(tools) = std::env::var_os(TOOLS_VARIABLE) {
        return Ok(PathBuf::from(tools));
    }
    let tools = directory.join("virtualtexture-tools");
    if !tools.join("generate-lod.py").exists() {
        println!("fetching Gaia Sky's scripts, since the benchmark runs beside them");
        shell::run(shell::command("git").args(["clone", "--depth", "1", REPOSITORY]).arg(&tools)).with_context(
            || format!("the scripts cannot be fetched; clone {REPOSITORY} and name its directory in {TOOLS_VARIABLE}"),
        )?;
    }
    Ok(tools)
}
