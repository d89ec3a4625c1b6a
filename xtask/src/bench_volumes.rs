//! `cargo xtask bench volumes`: pyramids of volumes by `vastex build` beside ome-zarr-py, at equal codec,
//! chunks and levels, in the same run; what was written is read by zarr-python, value by value. Then what
//! reading costs ([`reading`]), and what pictures do ([`pictures`]).
//!
//! CPU seconds of all threads are compared: both programs may use every core, and how well they do depends on
//! what else runs. The figures that are kept stand in docs/bench-volumes.md.

mod pictures;
mod reading;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::measure::{self, Run, median, medians};
use crate::shell::Usage;
use crate::{python, setup, shell};

const REPORT: &str = "docs/bench-volumes.md";
/// Voxels along x, y and z of the volume that both make levels of.
const SIZE: [u32; 3] = [512, 512, 256];
/// Levels: the last one is a chunk of 64 along the longest axis.
const LEVELS: u32 = 4;
/// How much less work a build must be than the nearest of the others, and what is aimed at.
const LEAST_RATIO: f64 = 5.0;
const AIM: f64 = 10.0;
/// What the scripts need.
const PACKAGES: &[&str] = &["zarr==3.1.6", "ome-zarr==0.18.0", "numpy"];
const TENSORSTORE: &str = "tensorstore==0.1.85";
/// The downscaling methods of ome-zarr-py: its default, and the one that makes means as `vastex build` does.
const METHODS: [&str; 2] = ["resize", "local_mean"];
/// How `vastex build` is called where the output is checked alone: what is asked for, and what is left out.
const CHECKED: &[(&str, &str)] =
    &[("0.5, chunks", ""), ("0.5, shards of 4", "--shards 4"), ("0.4, gzip", "--zarr 0.4 --compress gzip")];

const INTRODUCTION: &str = "\
# Volumes: beside ome-zarr-py, zarr-python and tensorstore; pictures

Written by `cargo xtask bench volumes --write`. Other programs may have been at work on the machine: seconds are of processors, and what counts are
ratios within a round.
";

const INPUT: &str = include_str!("volumes/input.py");
const PEER: &str = include_str!("volumes/peer.py");
const CHECK: &str = include_str!("volumes/check.py");
const PSNR: &str = include_str!("volumes/psnr.py");

struct Options {
    runs: usize,
    write: bool,
    /// Which parts are measured; what the page has of the other is kept.
    parts: Vec<Part>,
}

/// A part of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Levels,
    Reading,
    Pictures,
}

impl Part {
    const ALL: [Part; 3] = [Part::Levels, Part::Reading, Part::Pictures];

    /// As it is named.
    fn name(self) -> &'static str {
        match self {
            Part::Levels => "levels",
            Part::Reading => "reading",
            Part::Pictures => "pictures",
        }
    }

    /// How its text begins.
    fn heading(self) -> &'static str {
        match self {
            Part::Levels => "\n## Pyramids",
            Part::Reading => "\n## Bricks",
            Part::Pictures => "\n## Pictures",
        }
    }

    /// Its text in a page, to its end.
    fn of(self, page: &str) -> Option<&str> {
        let begin = page.find(self.heading())?;
        let others = Part::ALL.into_iter().filter(|part| *part != self);
        let ends = others.filter_map(|part| page.find(part.heading()).filter(|at| *at > begin));
        Some(&page[begin..ends.min().unwrap_or(page.len())])
    }
}

pub(crate) fn volumes(options: &[&str]) -> Result<()> {
    let options = parse(options)?;
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::GNU_TIME)?;
    let directory = shell::root().join("target/bench");
    std::fs::create_dir_all(&directory).with_context(|| format!("cannot create {}", directory.display()))?;
    let python = python::with(&directory, "python-volumes", PACKAGES)?;
    let scripts = Scripts::new(&directory, python)?;
    let input = scripts.input(&directory)?;
    let path = shell::root().join(REPORT);
    let before = std::fs::read_to_string(&path).unwrap_or_default();
    let mut page = INTRODUCTION.to_owned();
    for part in Part::ALL {
        let text = match part {
            _ if !options.parts.contains(&part) => part.of(&before).unwrap_or_default().to_owned(),
            Part::Levels => levels(&scripts, &input, &directory, options.runs)?,
            Part::Reading => {
                let has = python::add_if_possible(&directory, "python-volumes", "tensorstore", TENSORSTORE);
                let reading = reading::Reading::new(&scripts.python, has, &directory, (&input, SIZE))?;
                reading.page(options.runs)?
            }
            Part::Pictures => pictures::page(&scripts, &input, &directory, options.runs)?,
        };
        page.push_str(&text);
    }
    println!("\n{page}");
    if options.write {
        std::fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {REPORT}");
    }
    Ok(())
}

/// The part on pyramids.
fn levels(scripts: &Scripts, input: &Path, directory: &Path, runs: usize) -> Result<String> {
    shell::run(shell::cargo("build").args(["--release", "-p", "vastex-cli"]))?;
    let rounds = scripts.compare(input, directory, runs)?;
    page(&rounds, &scripts.checks(input, directory)?)
}

fn parse(options: &[&str]) -> Result<Options> {
    let mut parsed = Options { runs: 3, write: false, parts: Vec::new() };
    let mut rest = options.iter();
    while let Some(option) = rest.next() {
        match *option {
            "--write" => parsed.write = true,
            "--runs" => {
                let runs = rest.next().and_then(|number| number.parse().ok());
                let runs = runs.filter(|runs| (1..=100).contains(runs));
                parsed.runs = runs.ok_or_else(|| Usage("--runs takes a number from 1 to 100".to_owned()))?;
            }
            other => match Part::ALL.into_iter().find(|part| part.name() == other) {
                Some(part) => parsed.parts.push(part),
                None => return Err(Usage(format!("bench volumes has no option '{other}'")).into()),
            },
        }
    }
    if parsed.parts.is_empty() {
        parsed.parts.extend(Part::ALL);
    }
    Ok(parsed)
}

/// Python and the scripts that it runs, in a directory.
struct Scripts {
    python: PathBuf,
    directory: PathBuf,
}

fn words(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

impl Scripts {
    fn new(directory: &Path, python: PathBuf) -> Result<Scripts> {
        for (name, text) in [("input.py", INPUT), ("peer.py", PEER), ("check.py", CHECK), ("psnr.py", PSNR)] {
            let path = directory.join(name);
            std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(Scripts { python, directory: directory.to_owned() })
    }

    fn script(&self, name: &str) -> String {
        words(&self.directory.join(name))
    }

    /// The volume, made unless it is there.
    fn input(&self, directory: &Path) -> Result<PathBuf> {
        let [width, height, depth] = SIZE;
        let path = directory.join(format!("cells-{width}x{height}x{depth}.raw"));
        let bytes = u64::from(width) * u64::from(height) * u64::from(depth) * 2;
        if !path.metadata().is_ok_and(|found| found.len() == bytes) {
            println!("making {}", path.display());
            let mut command = shell::command(&words(&self.python));
            command.arg(self.script("input.py")).arg(&path).args(SIZE.map(|side| side.to_string()));
            shell::run(command.current_dir(directory))?;
        }
        Ok(path)
    }

    /// ome-zarr-py's methods, then `vastex build`, and that without a codec, in turn: [round][contender].
    fn compare(&self, input: &Path, directory: &Path, runs: usize) -> Result<Vec<Vec<Run>>> {
        let mut rounds = Vec::new();
        for round in 0..=runs {
            println!("round {round} of {runs}{}", if round == 0 { " (not counted)" } else { "" });
            let mut results = Vec::new();
            for method in METHODS {
                let output = directory.join("peer.zarr");
                let mut arguments = vec![self.script("peer.py"), words(input)];
                arguments.extend(SIZE.map(|side| side.to_string()));
                arguments.extend([method.to_owned(), LEVELS.to_string(), words(&output)]);
                results.push(measure::run(&words(&self.python), &arguments, &output)?);
            }
            let output = directory.join("vastex.zarr");
            results.push(measure::run(&words(&vastex()), &build(input, &output, ""), &output)?);
            self.check(&output, input)?;
            let plain = build(input, &output, "--compress none");
            results.push(measure::run(&words(&vastex()), &plain, &output)?);
            if round > 0 {
                rounds.push(results);
            }
        }
        Ok(rounds)
    }

    /// Builds what is not measured, and has it read: which volume, how it was built, and how many levels are
    /// equal.
    fn checks(&self, input: &Path, directory: &Path) -> Result<Vec<[String; 3]>> {
        let assets = shell::root().join("assets/volumes");
        let mut rows = Vec::new();
        for source in [input.to_owned(), assets.join("head.zip"), assets.join("nuclei.zip")] {
            for (how, more) in CHECKED {
                let output = directory.join("checked.zarr");
                if output.exists() {
                    std::fs::remove_dir_all(&output)?;
                }
                shell::run(shell::command(&words(&vastex())).args(build(&source, &output, more)))?;
                let levels = self.check(&output, &source)?;
                let name = source.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
                rows.push([name, (*how).to_owned(), levels]);
            }
        }
        Ok(rows)
    }

    /// Has zarr-python read what was built; gives the number of its levels, all equal to what NumPy makes.
    fn check(&self, output: &Path, source: &Path) -> Result<String> {
        let mut command = shell::command(&words(&self.python));
        command.arg(self.script("check.py")).arg(output).arg(source);
        if source.extension().is_some_and(|ending| ending == "raw") {
            command.args(SIZE.map(|side| side.to_string()));
        }
        let levels = shell::output(&mut command)?.trim().to_owned();
        ensure!(levels.parse::<u32>().is_ok(), "{} was not compared: {levels}", output.display());
        Ok(levels)
    }
}

fn build(input: &Path, output: &Path, more: &str) -> Vec<String> {
    let mut arguments =
        vec!["build".to_owned(), words(input), "-o".to_owned(), words(output), "--quiet".to_owned()];
    arguments.extend(more.split_whitespace().map(str::to_owned));
    arguments
}

fn vastex() -> PathBuf {
    shell::target_dir().join("release").join(format!("vastex{}", std::env::consts::EXE_SUFFIX))
}

fn page(rounds: &[Vec<Run>], checks: &[[String; 3]]) -> Result<String> {
    let [width, height, depth] = SIZE;
    let mut page = format!(
        "\n## Pyramids beside ome-zarr-py\n\n\
         On {} cores a volume of {width}x{height}x{depth} voxels of 16 bits, blobs with noise, raw and in the page cache,\n\
         becomes OME-Zarr 0.5 with {LEVELS} levels, each half of the one before along all axes, in chunks of 64 a side by zstd at level 3. ome-zarr-py ({})\n\
         does it by its default method, `resize`, and by `local_mean`, which is what `vastex build` makes. CPU seconds are those of all threads; the\n\
         ratios are medians of those within a round. Medians of {} interleaved runs.\n\n{}\n",
        std::thread::available_parallelism().map_or(1, usize::from),
        PACKAGES.join(", "),
        rounds.len(),
        measure::stamp()?,
    );
    page.push_str(
        "| program | wall s | CPU s | peak MB | written MB | CPU s / vastex |\n|---|---|---|---|---|---|\n",
    );
    let names = METHODS.map(|method| format!("ome-zarr-py, {method}"));
    let names = names.iter().map(String::as_str).chain(["vastex build", "vastex build, without a codec"]);
    for (index, name) in names.enumerate() {
        let column: Vec<Run> = rounds.iter().map(|round| round[index]).collect();
        let Run { wall, cpu, peak_mb, written_mb } = medians(&column);
        let ratio = ratio(rounds, index);
        writeln!(page, "| {name} | {wall:.2} | {cpu:.2} | {peak_mb:.0} | {written_mb:.1} | {ratio:.1} |")?;
    }
    page.push('\n');
    page.push_str(&verdict(rounds));
    page.push_str(
        "\nzarr-python reads what was built; every value of every level is that of NumPy's means:\n\n\
         | volume | built as | levels equal |\n|---|---|---|\n",
    );
    for [volume, how, levels] in checks {
        writeln!(page, "| {volume} | {how} | {levels} |")?;
    }
    Ok(page)
}

/// How many times the work of `vastex build` a contender's is.
fn ratio(rounds: &[Vec<Run>], index: usize) -> f64 {
    median(rounds.iter().map(|round| round[index].cpu / round[METHODS.len()].cpu).collect())
}

/// The most that a program which did nothing but encode could be of `vastex build`'s ratio to a contender:
/// what the codec takes is the difference of a build with it and one without.
fn ceiling(rounds: &[Vec<Run>], index: usize) -> f64 {
    let codec = |round: &Vec<Run>| round[METHODS.len()].cpu - round[METHODS.len() + 1].cpu;
    median(rounds.iter().map(|round| round[index].cpu / codec(round).max(f64::MIN_POSITIVE)).collect())
}

fn verdict(rounds: &[Vec<Run>]) -> String {
    let says = |holds: bool| if holds { "holds" } else { "DOES NOT HOLD" };
    let of_method = |(index, method): (usize, &str)| {
        let ratio = ratio(rounds, index);
        format!(
            "- At most a fifth of the CPU seconds of ome-zarr-py by `{method}`: {} ({ratio:.1} times less); the aim, a tenth: {}. A \
             program\n  that did nothing but encode with this codec would take {:.1} times less.\n",
            says(ratio >= LEAST_RATIO),
            says(ratio >= AIM),
            ceiling(rounds, index)
        )
    };
    METHODS.into_iter().enumerate().map(of_method).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_contender_has_a_verdict_and_what_the_codec_leaves() {
        let run = |cpu| Run { wall: cpu, cpu, peak_mb: 1.0, written_mb: 1.0 };
        let rounds = vec![
            vec![run(30.0), run(4.0), run(1.0), run(0.5)],
            vec![run(300.0), run(40.0), run(10.0), run(5.0)],
        ];
        assert_eq!((ratio(&rounds, 0), ratio(&rounds, 1)), (30.0, 4.0));
        assert_eq!((ceiling(&rounds, 0), ceiling(&rounds, 1)), (60.0, 8.0));
        let said = verdict(&rounds);
        assert!(said.contains("`resize`: holds (30.0 times less); the aim, a tenth: holds."), "{said}");
        assert!(
            said.contains("`local_mean`: DOES NOT HOLD (4.0") && said.contains("take 8.0 times less"),
            "{said}"
        );
        let checks = [["a".to_owned(), "b".to_owned(), "3".to_owned()]];
        assert!(page(&rounds, &checks).unwrap().contains("| vastex build | 5.50 | 5.50 | 1 | 1.0 | 1.0 |"));
    }

    #[test]
    fn what_is_not_measured_is_kept() {
        let page = "# Volumes\n\n## Pyramids of\na\n\n## Bricks of\nb\n\n## Boxes\nc\n";
        assert_eq!(Part::Levels.of(page), Some("\n## Pyramids of\na\n"));
        assert_eq!(Part::Reading.of(page), Some("\n## Bricks of\nb\n\n## Boxes\nc\n"));
        assert_eq!(Part::Reading.of("# Volumes\n"), None);
    }

    #[test]
    fn options_are_checked() {
        assert!(parse(&["--runs", "0"]).is_err() && parse(&["--fast"]).is_err());
        assert_eq!(parse(&[]).unwrap().parts, Part::ALL);
        assert_eq!(parse(&["reading", "--write"]).unwrap().parts, [Part::Reading]);
        assert!(parse(&["--write", "--runs", "2"]).is_ok_and(|options| options.write && options.runs == 2));
    }
}
