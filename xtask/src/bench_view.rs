//! `cargo xtask bench view`: how soon something can be seen of a file that nobody built, beside libvips'
//! thumbnail of it.
//!
//! The window is opened on a virtual display; it measures itself (`vastex view --times`), from the call to
//! open with the device and the window there. Each run has an empty cache, so that an image is built. The
//! figures that are kept stand in docs/bench-view.md.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::inputs::Input;
use crate::measure::{self, GNU_TIME, median};
use crate::shell::Usage;
use crate::{setup, shell};

const REPORT: &str = "docs/bench-view.md";
const RUNS: usize = 5;
/// The view, as wide as the thumbnail.
const SIZE: [&str; 2] = ["1280x720", "1280"];

/// What is asked of each file beside its first picture: milliseconds of 95 of 100 frames until all is sharp,
/// a share of a processor while nothing happens, and main memory, of all but progressive JPEGs, which are
/// held whole in any case.
const FRAME_MS: f64 = 100.0;
const IDLE_PERCENT: f64 = 1.0;
const PEAK_MB: f64 = 500.0;

/// A file to look at.
struct Case {
    name: &'static str,
    make: fn(&Path) -> Result<PathBuf>,
    /// Milliseconds until something of it must be seen.
    first_ms: f64,
    is_held_whole: bool,
    /// True if frames are drawn without a pause until the source is there.
    is_restless: bool,
}

impl Case {
    const fn new(name: &'static str, make: fn(&Path) -> Result<PathBuf>, first_ms: f64) -> Case {
        Case { name, make, first_ms, is_held_whole: false, is_restless: false }
    }
}

const CASES: &[Case] = &[
    Case::new("the real Earth, JPEG, 10800x5400", |directory| Input::EarthJpeg.make(directory), 1000.0),
    Case::new("the real Earth, PNG, 10800x5400", png, 1000.0),
    Case::new("a pyramid of libvips, 32768x16384", pyramid, 300.0),
    Case::new("the Earth enlarged, PNG, 43200x21600", large_png, 1000.0),
    Case {
        is_held_whole: true,
        ..Case::new("the Earth enlarged, progressive JPEG, 21600x10800", progressive, 1000.0)
    },
    Case {
        is_held_whole: true,
        is_restless: true,
        ..Case::new("the same, drawn without a pause", progressive, 1000.0)
    },
    Case::new("the Earth enlarged, TIFF of one strip, 21600x10800", one_strip, 1000.0),
    Case::new("the Earth enlarged, TIFF of tiles without levels, 43200x21600", tiles, 1000.0),
];

/// What the window says of one run, and what it took.
struct Seen {
    start_ms: f64,
    /// A preview, or the source where there was none.
    first_ms: f64,
    source_ms: f64,
    sharp_ms: f64,
    p95_ms: f64,
    worst_ms: f64,
    idle: f64,
    peak_mb: f64,
}

pub(crate) fn run(options: &[&str]) -> Result<()> {
    let write = match options {
        [] => false,
        ["--write"] => true,
        [other, ..] => return Err(Usage(format!("bench view has no option '{other}'")).into()),
    };
    for need in [&setup::C_COMPILER, &setup::NASM, &setup::VIPS, &setup::GNU_TIME, &setup::VIRTUAL_DISPLAY] {
        setup::ensure(need)?;
    }
    shell::run(shell::cargo("build").args(["--release", "-p", "vastex-cli"]))?;
    let directory = shell::root().join("target/bench");
    std::fs::create_dir_all(&directory).with_context(|| format!("cannot create {}", directory.display()))?;
    let (mut page, mut asked) = (introduction()?, String::new());
    for case in CASES {
        let file = (case.make)(&directory)?;
        let seen: Vec<Seen> =
            (0..RUNS).map(|_| look(&file, &directory, case.is_restless)).collect::<Result<_>>()?;
        let thumbnails: Vec<f64> = (0..RUNS).map(|_| thumbnail(&file, &directory)).collect::<Result<_>>()?;
        let row = row(case, &seen, median(thumbnails));
        let judged = verdicts(case, &seen);
        print!("{row}{judged}");
        page.push_str(&row);
        asked.push_str(&judged);
    }
    page.push_str(
        "\n## What is asked for\n\n| file | figure | asked | measured | |\n|---|---|---|---|---|\n",
    );
    page.push_str(&asked);
    if write {
        let path = shell::root().join(REPORT);
        std::fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
        println!("written to {REPORT}");
    }
    Ok(())
}

fn introduction() -> Result<String> {
    Ok(introduction_of(&measure::stamp()?))
}

fn introduction_of(stamp: &str) -> String {
    format!(
        "\
# How soon something can be seen

Made by `cargo xtask bench view`. Milliseconds from the call to open, with the device and the window there (their start is apart), to the
first picture, to the source itself and to the last tile, with an empty cache each time; medians of {RUNS} runs, but for the worst frame, which is the worst of all runs. Frames are those
until all is sharp, where one follows another without a pause: a window in which nothing changes draws none. Of the row drawn without a pause the window draws frames all the while until the source is there,
as for somebody who moves the camera meanwhile. Idle is the share of a processor for three seconds after that. The thumbnail is
that of `vipsthumbnail`, as wide as the window.

{stamp}

| file | start | first | source | sharp | frame, 95 % | worst | idle | peak MB | thumbnail | holds |
|---|---|---|---|---|---|---|---|---|---|---|
"
    )
}

/// A figure that is asked for: what of, in which unit, less than what, and what was measured.
struct Asked {
    what: &'static str,
    unit: &'static str,
    less_than: f64,
    measured: f64,
}

impl Asked {
    fn holds(&self) -> bool {
        self.measured < self.less_than
    }
}

fn asked_of(case: &Case, seen: &[Seen]) -> Vec<Asked> {
    let of = |figure: fn(&Seen) -> f64| median(seen.iter().map(figure).collect());
    let asked = |what, unit, less_than, measured| Asked { what, unit, less_than, measured };
    let mut all = vec![
        asked("first picture", "ms", case.first_ms, of(|s| s.first_ms)),
        asked("95 % of frames", "ms", FRAME_MS, of(|s| s.p95_ms)),
        asked("idle", "% of a core", IDLE_PERCENT, 100.0 * of(|s| s.idle)),
    ];
    if !case.is_held_whole {
        all.push(asked("peak", "MB", PEAK_MB, of(|s| s.peak_mb)));
    }
    all
}

/// What is asked for, a line each, and whether it holds.
fn verdicts(case: &Case, seen: &[Seen]) -> String {
    let mut lines = String::new();
    for asked in asked_of(case, seen) {
        let Asked { what, unit, less_than, measured } = asked;
        let verdict = if asked.holds() { "holds" } else { "DOES NOT HOLD" };
        // Small figures have a digit more.
        let digits = if less_than < 10.0 { 1 } else { 0 };
        let _ = writeln!(
            lines,
            "| {} | {what} | < {less_than:.0} {unit} | {measured:.digits$} | {verdict} |",
            case.name
        );
    }
    lines
}

fn row(case: &Case, seen: &[Seen], thumbnail_ms: f64) -> String {
    let of = |figure: fn(&Seen) -> f64| median(seen.iter().map(figure).collect());
    let is_kept = asked_of(case, seen).iter().all(Asked::holds);
    let mut row = format!("| {} ", case.name);
    let figures: [fn(&Seen) -> f64; 5] =
        [|s| s.start_ms, |s| s.first_ms, |s| s.source_ms, |s| s.sharp_ms, |s| s.p95_ms];
    for figure in figures {
        let _ = write!(row, "| {:.0} ", of(figure));
    }
    // The worst is of all runs: a median of worst ones hides it.
    let worst = seen.iter().map(|s| s.worst_ms).fold(0.0, f64::max);
    let _ = write!(row, "| {worst:.0} ");
    let verdict = if is_kept { "all" } else { "NOT ALL" };
    let _ = writeln!(
        row,
        "| {:.1} % | {:.0} | {thumbnail_ms:.0} | {verdict} |",
        100.0 * of(|s| s.idle),
        of(|s| s.peak_mb)
    );
    row
}

/// Opens a file in a window, with an empty cache.
fn look(file: &Path, directory: &Path, is_restless: bool) -> Result<Seen> {
    let cache = directory.join("view-cache");
    if cache.exists() {
        std::fs::remove_dir_all(&cache)?;
    }
    let (report, program) = (directory.join("view-time.txt"), shell::target_dir().join("release/vastex"));
    let mut command = shell::command("xvfb-run");
    command.args(["-a", "-s", "-screen 0 1280x800x24", GNU_TIME, "-f", "%M", "-o"]).arg(&report);
    command.arg(program).arg("view").arg(file).args(["--times", "--size", SIZE[0], "--cache"]).arg(&cache);
    if is_restless {
        command.arg("--restless");
    }
    let said = shell::output(command.stderr(Stdio::inherit()))?;
    let figure =
        |name: &str| measure::number(&said, name).with_context(|| format!("{name} is not in {said}"));
    let source_ms = figure("source_ms")?;
    let peak = std::fs::read_to_string(&report)?;
    let peak_mb =
        peak.trim().parse::<f64>().with_context(|| format!("{GNU_TIME} wrote {peak}"))? * 1024.0 / 1e6;
    Ok(Seen {
        start_ms: figure("start_ms")?,
        first_ms: measure::number(&said, "preview_ms").unwrap_or(source_ms),
        source_ms,
        sharp_ms: figure("sharp_ms")?,
        p95_ms: figure("frame_p95_ms")?,
        worst_ms: figure("frame_worst_ms")?,
        idle: figure("idle")?,
        peak_mb,
    })
}

/// Milliseconds that libvips takes for a thumbnail.
fn thumbnail(file: &Path, directory: &Path) -> Result<f64> {
    let begun = Instant::now();
    let mut command = shell::command("vipsthumbnail");
    shell::output(command.arg(file).args(["-s", SIZE[1], "-o"]).arg(directory.join("thumbnail.png")))?;
    Ok(1000.0 * begun.elapsed().as_secs_f64())
}

/// What libvips makes of an image, unless it is there already.
fn made(directory: &Path, name: &str, image: &Path, arguments: [&[&str]; 2]) -> Result<PathBuf> {
    let path = directory.join(name);
    if !path.exists() {
        let [before, after] = arguments;
        shell::run(shell::command("vips").args(before).arg(image).arg(&path).args(after))?;
    }
    Ok(path)
}

fn png(directory: &Path) -> Result<PathBuf> {
    made(directory, "earth.png", &Input::EarthJpeg.make(directory)?, [&["copy"], &[]])
}

fn large_png(directory: &Path) -> Result<PathBuf> {
    made(directory, "earth-43200x21600.png", &Input::EarthJpeg.make(directory)?, [&["resize"], &["4"]])
}

fn progressive(directory: &Path) -> Result<PathBuf> {
    enlarged(directory, "earth-progressive.jpg", "[interlace,Q=90]", "2")
}

fn one_strip(directory: &Path) -> Result<PathBuf> {
    enlarged(directory, "earth-one-strip.tif", "[compression=deflate,tile_height=10800]", "2")
}

/// Of several thousand tiles, of which each is a small part.
fn tiles(directory: &Path) -> Result<PathBuf> {
    let options = "[tile,tile_width=256,tile_height=256,compression=deflate]";
    enlarged(directory, "earth-tiles.tif", options, "4")
}

/// The Earth so many times as wide and high, unless it is there already; `options` are how libvips saves it.
fn enlarged(directory: &Path, name: &str, options: &str, times: &str) -> Result<PathBuf> {
    let path = directory.join(name);
    if !path.exists() {
        let mut saved = path.clone().into_os_string();
        saved.push(options);
        let image = Input::EarthJpeg.make(directory)?;
        shell::run(shell::command("vips").arg("resize").arg(image).arg(saved).arg(times))?;
    }
    Ok(path)
}

fn pyramid(directory: &Path) -> Result<PathBuf> {
    let image = Input::Mirrored { across: 2, down: 2 }.make(directory)?;
    let options =
        ["--tile", "--pyramid", "--compression", "jpeg", "--tile-width", "256", "--tile-height", "256"];
    made(directory, "earth-pyramid.tif", &image, [&["tiffsave"], &options])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_figure_that_is_asked_for_has_a_verdict() {
        let case = &CASES[0];
        let seen = |p95_ms, idle| Seen {
            start_ms: 80.0,
            first_ms: 999.0,
            source_ms: 2000.0,
            sharp_ms: 3000.0,
            p95_ms,
            worst_ms: 150.0,
            idle,
            peak_mb: 499.0,
        };
        let good = [seen(99.0, 0.009)];
        assert!(verdicts(case, &good).lines().all(|line| line.ends_with("| holds |")));
        assert!(row(case, &good, 1.0).ends_with("| all |\n"));
        // The median of what was measured counts.
        let bad = [seen(100.0, 0.02), seen(101.0, 0.0), seen(2.0, 0.02)];
        let judged = verdicts(case, &bad);
        let missed: Vec<&str> = judged.lines().filter(|line| line.ends_with("| DOES NOT HOLD |")).collect();
        assert_eq!(missed.len(), 2, "{judged}");
        assert!(
            missed[0].contains("95 % of frames | < 100 ms | 100 ")
                && missed[1].contains("idle | < 1 % of a core | 2.0 ")
        );
        assert!(row(case, &bad, 1.0).ends_with("| NOT ALL |\n"));
        let of_worst = |worst_ms| Seen { worst_ms, ..seen(1.0, 0.0) };
        let worst = row(case, &[of_worst(60.0), of_worst(70.0), of_worst(431.0)], 1.0);
        assert!(worst.contains("| 1 | 431 |"), "{worst}");
        // What is held whole is not asked for little memory.
        let whole = Case { is_held_whole: true, ..Case::new("whole", png, 1000.0) };
        let judged = [verdicts(case, &good), verdicts(&whole, &good)];
        assert_eq!(judged.map(|lines| lines.matches("| peak |").count()), [1, 0]);
        let columns = |line: &str| line.matches('|').count();
        let head = introduction_of("").lines().rev().nth(1).map(columns);
        assert_eq!(head, Some(columns(&row(case, &good, 1.0))));
    }

    #[test]
    fn figures_are_found_in_what_the_window_says() {
        let said = r#"{"start_ms":12.5,"preview_ms":null,"idle":0.001}"#;
        assert_eq!(
            [measure::number(said, "start_ms"), measure::number(said, "idle")],
            [Some(12.5), Some(0.001)]
        );
        assert_eq!([measure::number(said, "preview_ms"), measure::number(said, "sharp_ms")], [None, None]);
    }
}
