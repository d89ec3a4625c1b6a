//! `cargo xtask bench build`: preparing data with `vastex build` beside libvips, on the same images in the
//! same run.
//!
//! A shared machine is noisy, so the programs take turns and only ratios within a turn count; peak memory and
//! bytes are what can be trusted to the digit. The figures that are kept stand in docs/bench-build.md.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::inputs::Input;
use crate::measure::{self, Run, median, medians};
use crate::shell::Usage;
use crate::{block_speed, gaia_sky, land_mask, setup, shapes, shell};

const REPORT: &str = "docs/bench-build.md";
/// The peak that a build of the Earth may have, in units of 10^6 bytes.
const PEAK_LIMIT_MB: f64 = 150.0;
const EARTH_16K: Input = Input::Mirrored { across: 1, down: 1 };
const EARTH_32K: Input = Input::Mirrored { across: 2, down: 2 };
/// What is compressed in blocks.
const BLOCKS: Input = EARTH_16K;
/// How fast a raw build of 16384 texels must be beside dzsave, and beside the pyramid TIFF.
const LEAST_SPEEDS: [f64; 2] = [2.0, 0.8];
/// How fast a raw build from JPEG must be beside dzsave from the same file.
const LEAST_SPEED_FROM_JPEG: f64 = 3.0;
/// The contender that these are asked of.
const RAW: usize = 2;
/// The images, with how many rounds are played of them: all that are asked for, or one, for what memory and
/// bytes they take.
const INPUTS: &[(Input, bool)] =
    &[(Input::Earth, true), (Input::EarthJpeg, true), (EARTH_16K, true), (EARTH_32K, false)];

/// A program in the comparison. In its arguments IN and OUT stand for the files.
struct Contender {
    name: &'static str,
    program: Program,
    arguments: &'static str,
    output: &'static str,
}

#[derive(PartialEq)]
enum Program {
    Vastex,
    Other(&'static str),
}

/// The anchors come first: the program whose output is closest to a container, then the fastest that makes a
/// pyramid.
const CONTENDERS: &[Contender] = &[
    Contender {
        name: "vips dzsave, raw, borders of 1",
        program: Program::Other("vips"),
        arguments: "dzsave IN OUT --tile-size 254 --overlap 1 --suffix .tif[compression=none] --container zip --compression 0",
        output: "dzsave.zip",
    },
    Contender {
        name: "vips pyramid TIFF, raw, no borders",
        program: Program::Other("vips"),
        arguments: "tiffsave IN OUT --tile --pyramid --tile-width 256 --tile-height 256 --bigtiff",
        output: "pyramid.tif",
    },
    Contender {
        name: "vastex, raw, pages of 256, linear light",
        program: Program::Vastex,
        arguments: "build IN -o OUT --page 256 --compress none",
        output: "raw.vastex",
    },
    Contender {
        name: "vastex, raw, pages of 256, as stored",
        program: Program::Vastex,
        arguments: "build IN -o OUT --page 256 --compress none --linear off",
        output: "stored.vastex",
    },
    Contender {
        name: "vastex, LZ4, linear light (the default)",
        program: Program::Vastex,
        arguments: "build IN -o OUT",
        output: "lz4.vastex",
    },
];

struct Options {
    runs: usize,
    write: bool,
    /// Only the section about block compression.
    blocks: bool,
}

pub(crate) fn build(options: &[&str]) -> Result<()> {
    let options = parse(options)?;
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::NASM)?;
    setup::ensure(&setup::VIPS)?;
    let directory = shell::root().join("target/bench");
    std::fs::create_dir_all(&directory).with_context(|| format!("cannot create {}", directory.display()))?;
    if options.blocks {
        let stamp = measure::stamp()?;
        let section = block_speed::compare(&BLOCKS.make(&directory)?, options.runs, &stamp)?;
        println!("{section}");
        return if options.write { write_section(&section) } else { Ok(()) };
    }
    setup::ensure(&setup::GNU_TIME)?;
    shell::run(shell::cargo("build").args(["--release", "-p", "vastex-cli"]))?;
    let mut page = introduction()?;
    for &(input, every_round) in INPUTS {
        println!("\n{}", input.name());
        let rounds =
            compare(&input.make(&directory)?, &directory, if every_round { options.runs } else { 1 })?;
        let table = table(input, &rounds)?;
        println!("\n{table}");
        page.push_str(&table);
    }
    let parts = [
        block_speed::compare(&BLOCKS.make(&directory)?, options.runs, "")?,
        block_speed::encoders_at_work(&BLOCKS.make(&directory)?)?,
        shapes::compare(&directory, &vastex())?,
        land_mask::measure(&directory, &vastex(), options.runs)?,
        gaia_sky::compare(&directory, &vastex(), options.runs)?,
    ];
    for part in parts {
        println!("{part}");
        page.push_str(&part);
    }
    if options.write { write(&page) } else { Ok(()) }
}

fn write(page: &str) -> Result<()> {
    let path = shell::root().join(REPORT);
    std::fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
    println!("written to {REPORT}");
    Ok(())
}

/// Writes one section of the page in the place of the one that has the same heading.
fn write_section(section: &str) -> Result<()> {
    let path = shell::root().join(REPORT);
    let page = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let replaced = with_section(&page, section);
    write(&replaced.with_context(|| format!("{REPORT} has no such section; write all of it first"))?)
}

/// A page with this section, which begins with an empty line and its heading, in the place of the one that
/// has the same heading; `None` if the page has none.
fn with_section(page: &str, section: &str) -> Option<String> {
    let heading = section.lines().find(|line| !line.is_empty())?;
    let start = page.find(&format!("\n{heading}\n"))?;
    let after = start + 1 + heading.len();
    let end = page[after..].find("\n## ").map_or(page.len(), |next| after + next);
    Some(format!("{}{}{}", &page[..start], section, &page[end..]))
}

fn parse(options: &[&str]) -> Result<Options> {
    let mut parsed = Options { runs: 5, write: false, blocks: false };
    let mut rest = options.iter();
    while let Some(option) = rest.next() {
        match *option {
            "blocks" => parsed.blocks = true,
            "--write" => parsed.write = true,
            "--runs" => {
                let runs = rest
                    .next()
                    .and_then(|number| number.parse().ok())
                    .filter(|runs| (1..=1000).contains(runs));
                parsed.runs = runs.ok_or_else(|| Usage("--runs takes a number from 1 to 1000".to_owned()))?;
            }
            other => return Err(Usage(format!("bench build has no option '{other}'")).into()),
        }
    }
    Ok(parsed)
}

/// All contenders in turn, `runs` times, after one uncounted round that fills the page cache:
/// [round][contender].
fn compare(input: &Path, directory: &Path, runs: usize) -> Result<Vec<Vec<Run>>> {
    let mut rounds = Vec::with_capacity(runs);
    for round in 0..=runs {
        println!("round {round} of {runs}{}", if round == 0 { " (not counted)" } else { "" });
        let results = CONTENDERS
            .iter()
            .map(|contender| run(contender, input, directory))
            .collect::<Result<Vec<_>>>()?;
        if round > 0 {
            rounds.push(results);
        }
    }
    Ok(rounds)
}

fn run(contender: &Contender, input: &Path, directory: &Path) -> Result<Run> {
    let output = directory.join(contender.output);
    let program = match contender.program {
        Program::Vastex => vastex().to_string_lossy().into_owned(),
        Program::Other(name) => name.to_owned(),
    };
    let path = |path: &Path| path.to_string_lossy().into_owned();
    let arguments: Vec<String> = contender
        .arguments
        .split(' ')
        .map(|word| match word {
            "IN" => path(input),
            "OUT" => path(&output),
            word => word.to_owned(),
        })
        .collect();
    measure::run(&program, &arguments, &output)
}

fn vastex() -> PathBuf {
    shell::target_dir().join("release").join(format!("vastex{}", std::env::consts::EXE_SUFFIX))
}

/// What stands above the tables.
fn introduction() -> Result<String> {
    let mut page = format!(
        "# Preparing data: `vastex build` beside libvips\n\n\
         Written by `cargo xtask bench build --write` on {} cores, with {}. The inputs are RGB TIFFs of strips, and a JPEG, in the page\n\
         cache. libvips writes RGB and filters it as it is stored; a container holds RGBA with borders of 4 texels, filtered\n\
         in linear light unless said. The speeds are medians of the ratios within one round, since the machine's own speed\n\
         varies between rounds; before each run what was written is brought to the disk. Identical tiles are stored once in a container, which matters where an image repeats, as the\n\
         mirrored copies do from 32768 texels on.\n\nWhat the memory is for: where two threads or more encode, the row of pages that comes next is filtered while one is encoded, and freed memory is\n\
         kept for the tiles that come next. With two threads that row takes about 9 MB of 50 on the real Earth with LZ4, and saves a quarter of the time; without\n\
         compression 10 MB of 74, and some 5 % of the time; kept memory takes 5 MB without compression, and saves a tenth of the work. `--memory-mib 60`, or 80 without compression, builds that\n\
         image without the row, in 41 MB and in 64; before there were both, a build took 42 and 58.\n\n{}\nThe commands:\n\n```\n",
        std::thread::available_parallelism().map_or(1, usize::from),
        shell::output(shell::command("vips").arg("--version"))?.trim(),
        measure::stamp()?,
    );
    for contender in CONTENDERS {
        let program = if let Program::Other(name) = contender.program { name } else { "vastex" };
        writeln!(page, "{program} {}", contender.arguments)?;
    }
    page.push_str("```\n");
    Ok(page)
}

/// The comparison on one image.
fn table(input: Input, rounds: &[Vec<Run>]) -> Result<String> {
    let mut page = format!("\n## {}\n\n", input.name());
    writeln!(
        page,
        "Medians of {} interleaved runs.\n\n\
         | program | wall s | CPU s | peak MB | written MB | Mpix/s | speed / dzsave | speed / pyramid | CPU s / dzsave |\n\
         |---|---|---|---|---|---|---|---|---|",
        rounds.len(),
    )?;
    let [width, height] = input.size();
    for (index, contender) in CONTENDERS.iter().enumerate() {
        writeln!(page, "{}", row(contender, index, rounds, (width * height) as f64 / 1e6))?;
    }
    page.push('\n');
    page.push_str(&verdict(input, rounds));
    Ok(page)
}

fn row(contender: &Contender, index: usize, rounds: &[Vec<Run>], megapixels: f64) -> String {
    let Run { wall, cpu, peak_mb, written_mb } = medians(&column(index, rounds));
    let [speed, beside_pyramid] =
        [0, 1].map(|anchor| ratio(rounds, |round| round[anchor].wall / round[index].wall));
    let work = ratio(rounds, |round| round[index].cpu / round[0].cpu);
    let rate = megapixels / wall;
    format!(
        "| {} | {wall:.2} | {cpu:.2} | {peak_mb:.0} | {written_mb:.0} | {rate:.0} | {speed:.2} | {beside_pyramid:.2} | {work:.2} |",
        contender.name
    )
}

/// What must hold of the figures of an image, and whether it does.
fn verdict(input: Input, rounds: &[Vec<Run>]) -> String {
    let says = |holds: bool| if holds { "holds" } else { "DOES NOT HOLD" };
    let (theirs, ours): (Vec<usize>, Vec<usize>) =
        (0..CONTENDERS.len()).partition(|&index| CONTENDERS[index].program != Program::Vastex);
    let peaks = |indices: &[usize]| -> Vec<f64> {
        indices.iter().flat_map(|&index| column(index, rounds)).map(|run| run.peak_mb).collect()
    };
    let highest = |peaks: Vec<f64>| peaks.into_iter().fold(0.0, f64::max);
    let peak = highest(peaks(&ours));
    let speed = |anchor: usize, index: usize| ratio(rounds, |round| round[anchor].wall / round[index].wall);
    match input {
        EARTH_16K => theirs
            .iter()
            .zip(LEAST_SPEEDS)
            .map(|(&anchor, least)| {
                let speed = speed(anchor, RAW);
                let (ours, theirs) = (CONTENDERS[RAW].name, CONTENDERS[anchor].name);
                format!(
                    "- `{ours}` at least {least} times as fast as `{theirs}`: {} ({speed:.2}).\n",
                    says(speed >= least)
                )
            })
            .collect(),
        Input::EarthJpeg => {
            let (speed, least) = (speed(0, RAW), LEAST_SPEED_FROM_JPEG);
            let (ours, theirs) = (CONTENDERS[RAW].name, CONTENDERS[0].name);
            format!(
                "- `{ours}` at least {least:.0} times as fast as `{theirs}` from the same JPEG: {} ({speed:.2}).\n",
                says(speed >= least)
            )
        }
        EARTH_32K => {
            let least = peaks(&theirs).into_iter().fold(f64::INFINITY, f64::min);
            format!(
                "- Peak memory of every variant no higher than that of either of libvips': {} ({peak:.0} MB and {least:.0} MB).\n",
                says(peak <= least)
            )
        }
        _ => {
            let slowest = ours.iter().map(|&index| speed(0, index)).fold(f64::INFINITY, f64::min);
            format!(
                "- Faster than dzsave, every variant: {} (the slowest is {slowest:.2} times as fast).\n\
                 - Peak memory under {PEAK_LIMIT_MB:.0} MB in every run: {} (the highest is {peak:.0} MB).\n",
                says(slowest > 1.0),
                says(peak < PEAK_LIMIT_MB),
            )
        }
    }
}

fn column(index: usize, rounds: &[Vec<Run>]) -> Vec<Run> {
    rounds.iter().map(|round| round[index]).collect()
}

fn ratio(rounds: &[Vec<Run>], within: impl Fn(&[Run]) -> f64) -> f64 {
    median(rounds.iter().map(|round| within(round)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_written_in_the_place_of_the_old_one() {
        let page = "# Page\n\nText.\n\n## One\n\n1\n\n## Two\n\n2\n";
        let with = |section| with_section(page, section);
        assert_eq!(with("\n## One\n\none\n").unwrap(), page.replace("\n1\n", "\none\n"));
        assert_eq!(with("\n## Two\n\ntwo\n").unwrap(), page.replace("\n2\n", "\ntwo\n"));
        assert_eq!(with("\n## Three\n\n3\n"), None);
    }

    #[test]
    fn a_ratio_is_taken_within_each_round() {
        // The machine is ten times slower in the second round; the contender is twice as fast in both.
        let run = |wall| Run { wall, cpu: wall, peak_mb: 10.0, written_mb: 1.0 };
        let round = |anchor: f64| {
            let mut round = vec![run(anchor / 2.0); CONTENDERS.len()];
            round[0] = run(anchor);
            round
        };
        let rounds = [round(1.0), round(10.0)];
        assert_eq!(ratio(&rounds, |round| round[0].wall / round[2].wall), 2.0);
        let earth = verdict(Input::Earth, &rounds);
        assert!(earth.contains("(the slowest is 2.00 times as fast)") && !earth.contains("NOT"), "{earth}");
        let [fast_enough, too_slow] = [2.0, 2.1].map(|slower| {
            let mut rounds = rounds.clone();
            rounds.iter_mut().for_each(|round| round[RAW].wall *= slower / 2.0);
            verdict(EARTH_16K, &rounds).matches("NOT").count()
        });
        assert_eq!((fast_enough, too_slow), (0, 1));
        // The raw build is twice as fast as dzsave, where three times are asked.
        assert_eq!(verdict(Input::EarthJpeg, &rounds).matches("NOT").count(), 1);
    }
}
