//! A build that was interrupted anywhere, any number of times, whatever became of what it left, ends in the
//! same bytes.

use std::cell::Cell;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::common::{texels, write_png};
use png::{BitDepth, ColorType};
use vastex_build::{BuildError, BuildOptions, BuildReport, Compression, PartOf, Progress, Quality, build};

/// Numbers that look random, the same in each run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % end.max(1)
    }
}

/// Cancels when so many rows are read.
struct StopAt(u64);

impl Progress for StopAt {
    fn advance(&self, rows_done: u64, _: u64, _: u64) -> ControlFlow<()> {
        if rows_done >= self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// A directory with an image and the container that an uninterrupted build makes of it.
struct Bench {
    dir: tempfile::TempDir,
    options: BuildOptions,
    whole: Vec<u8>,
    report: BuildReport,
}

impl Bench {
    /// An image of which a part repeats and a part has one colour.
    fn new(size: [u32; 2], options: BuildOptions) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let mut data = texels((3 * size[0] * size[1]) as usize, size[0] + size[1]);
        let third = data.len() / 3;
        data[third..third + third / 2].fill(9);
        let (first, rest) = data.split_at_mut(2 * third);
        let len = rest.len().min(first.len());
        rest[..len].copy_from_slice(&first[..len]);
        write_png(&dir.path().join("in.png"), size, ColorType::Rgb, BitDepth::Eight, &data);
        let mut bench = Bench { dir, options, whole: Vec::new(), report: BuildReport::default() };
        bench.report = bench.build(&bench.options, &()).unwrap();
        bench.whole = fs::read(bench.output()).unwrap();
        bench.expect_names(&["in.png", "out.vastex"]);
        fs::remove_file(bench.output()).unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn output(&self) -> PathBuf {
        self.path("out.vastex")
    }

    /// What an interrupted build leaves.
    fn left(&self) -> [PathBuf; 2] {
        [self.path(".out.vastex.partial"), self.path(".out.vastex.journal")]
    }

    fn build(&self, options: &BuildOptions, progress: &dyn Progress) -> Result<BuildReport, BuildError> {
        build(&[self.path("in.png")], &self.output(), options, progress)
    }

    fn resume(&self, threads: usize) -> BuildReport {
        self.build(&BuildOptions { resume: true, threads, ..self.options.clone() }, &()).unwrap()
    }

    /// Interrupts a build that can be resumed after so many rows.
    fn interrupt(&self, rows: u64) {
        let options = BuildOptions { resume: true, ..self.options.clone() };
        let cancelled = self.build(&options, &StopAt(rows));
        assert!(matches!(cancelled, Err(BuildError::Cancelled)), "{cancelled:?}");
        assert!(!self.output().exists());
    }

    #[track_caller]
    fn expect_names(&self, expected: &[&str]) {
        let entries = fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        assert_eq!(names, expected);
    }

    /// The output is that of an uninterrupted build, and nothing else is left; ready for the next one.
    #[track_caller]
    fn expect_whole(&self, report: &BuildReport) {
        assert!(fs::read(self.output()).unwrap() == self.whole, "other bytes; {report:?}");
        let expected = BuildReport { resumed_tiles: report.resumed_tiles, ..self.report.clone() };
        assert_eq!(
            BuildReport {
                row_bytes_held: expected.row_bytes_held,
                memory: expected.memory,
                ..report.clone()
            },
            expected
        );
        self.expect_names(&["in.png", "out.vastex"]);
        fs::remove_file(self.output()).unwrap();
    }
}

fn pages_of(page: u32) -> BuildOptions {
    BuildOptions { page, compression: Compression::None, threads: 2, ..BuildOptions::default() }
}

/// Cuts a file off somewhere or flips a bit of it, as a kill or a failing disk may.
fn damage(path: &Path, dice: &mut Dice) {
    let mut bytes = fs::read(path).unwrap();
    let at = dice.below(bytes.len());
    match dice.below(4) {
        0 => fs::remove_file(path).unwrap(),
        1 if !bytes.is_empty() => {
            bytes[at] ^= 1 << dice.below(8);
            fs::write(path, bytes).unwrap();
        }
        _ => fs::write(path, &bytes[..at]).unwrap(),
    }
}

#[test]
fn whatever_is_left_of_partial_file_and_journal_the_bytes_are_the_same() {
    let mut dice = Dice(1);
    for compression in [Compression::None, Compression::Lz4] {
        let bench = Bench::new([300, 260], BuildOptions { compression, ..pages_of(16) });
        bench.interrupt(260);
        let left = bench.left().map(|path| fs::read(path).unwrap());
        for case in 0..80 {
            for (path, bytes) in bench.left().iter().zip(&left) {
                fs::write(path, bytes).unwrap();
            }
            let [partial, journal] = bench.left();
            match case % 4 {
                0 => {}
                1 => damage(&partial, &mut dice),
                2 => damage(&journal, &mut dice),
                _ => [partial, journal].iter().for_each(|path| damage(path, &mut dice)),
            }
            let report = bench.resume(1 + case % 3);
            assert!(case % 4 > 0 || report.resumed_tiles == report.tiles, "{report:?}");
            bench.expect_whole(&report);
        }
    }
}

#[test]
fn many_interruptions_in_a_row_end_in_the_same_bytes() {
    let mut dice = Dice(2);
    let zero = BuildOptions { filter: Some("kaiser@zero".parse().unwrap()), ..pages_of(40) };
    // The wide kernel looks far, so a small image is slow enough.
    let benches = [([300, 1500], pages_of(40)), ([100, 900], zero)];
    let benches = benches.map(|(size, options)| (size[1], Bench::new(size, options)));
    let mut taken_over = Vec::new();
    for case in 0..6 {
        let (height, bench) = &benches[case / 4];
        for _ in 0..1 + dice.below(4) {
            bench.interrupt(dice.below(*height as usize) as u64);
            if case % 2 == 1 {
                let victim = &bench.left()[dice.below(2)];
                damage(victim, &mut dice);
            }
        }
        let report = bench.resume(1 + case % 3);
        taken_over.push(report.resumed_tiles);
        bench.expect_whole(&report);
    }
    assert!(taken_over.iter().filter(|&&tiles| tiles > 0).count() >= 3, "{taken_over:?}");
}

/// Copies what a kill would leave at this instant, when so many rows are read.
struct CopyAt<'a>(&'a Bench, u64, Cell<bool>);

impl Progress for CopyAt<'_> {
    fn advance(&self, rows_done: u64, _: u64, _: u64) -> ControlFlow<()> {
        if rows_done >= self.1 && !self.2.replace(true) {
            for (path, name) in self.0.left().iter().zip(["partial", "journal"]) {
                fs::copy(path, self.0.path(name)).unwrap();
            }
        }
        ControlFlow::Continue(())
    }
}

#[test]
fn what_a_killed_build_leaves_is_gone_on_with_even_if_nobody_meant_to_resume_it() {
    let bench = Bench::new([350, 1500], pages_of(32));
    let mut taken_over = 0;
    for rows in [0, 400, 750, 1150, 1500] {
        bench.build(&bench.options, &CopyAt(&bench, rows, Cell::new(false))).unwrap();
        fs::remove_file(bench.output()).unwrap();
        for (path, name) in bench.left().iter().zip(["partial", "journal"]) {
            fs::rename(bench.path(name), path).unwrap();
        }
        let report = bench.resume(2);
        taken_over += report.resumed_tiles;
        bench.expect_whole(&report);
    }
    assert!(taken_over > 0);
}

#[test]
fn a_build_that_is_not_to_be_resumed_starts_anew_and_leaves_nothing() {
    let bench = Bench::new([300, 260], pages_of(16));
    bench.interrupt(260);
    let report = bench.build(&bench.options, &()).unwrap();
    assert_eq!(report.resumed_tiles, 0);
    bench.expect_whole(&report);
    bench.interrupt(260);
    for rows in [0, 100, 260] {
        assert!(matches!(bench.build(&bench.options, &StopAt(rows)), Err(BuildError::Cancelled)));
        bench.expect_names(&["in.png"]);
    }
}

#[test]
fn what_is_left_of_another_build_is_refused_and_stays() {
    let bench = Bench::new([300, 260], pages_of(16));
    bench.interrupt(260);
    let left = bench.left().map(|path| fs::read(path).unwrap());
    let refused = |options: BuildOptions| {
        let error = bench.build(&BuildOptions { resume: true, ..options }, &()).unwrap_err().to_string();
        assert!(error.contains("build without --resume, which starts anew"), "{error}");
        assert_eq!(bench.left().map(|path| fs::read(path).unwrap()), left);
        error
    };
    let cases = [
        (pages_of(32), "of other options: page was 16 and is 32;"),
        (BuildOptions { linear: false, ..pages_of(16) }, "linear was true and is false;"),
        (BuildOptions { compression: Compression::Lz4, ..pages_of(16) }, "compress was none and is lz4;"),
        (BuildOptions { quality: Quality::Best, ..pages_of(16) }, "quality was normal and is best;"),
        (
            BuildOptions { quality: Quality::Best, tolerant: true, ..pages_of(16) },
            "quality was normal and is best, tolerant was false and is true;",
        ),
    ];
    for (options, words) in cases {
        let error = refused(options);
        assert!(error.contains(words), "{error}");
    }
    let (image, changed) =
        (fs::read(bench.path("in.png")).unwrap(), bench.path("in.png").metadata().unwrap());
    let other = texels(3 * 300 * 260, 77);
    write_png(&bench.path("in.png"), [300, 260], ColorType::Rgb, BitDepth::Eight, &other);
    assert!(refused(pages_of(16)).contains("the input has changed"));
    // The same bytes at another time may be others where nobody looked.
    fs::write(bench.path("in.png"), image).unwrap();
    set_time(&bench.path("in.png"), changed.modified().unwrap() + Duration::from_secs(1));
    assert!(refused(pages_of(16)).contains("the input has changed"));
    set_time(&bench.path("in.png"), changed.modified().unwrap());
    let report = bench.build(&BuildOptions { resume: true, durable: true, ..pages_of(16) }, &()).unwrap();
    assert_eq!(report.resumed_tiles, report.tiles);
    bench.expect_whole(&report);
}

/// Builds the same once more in the middle of a build.
struct BuildTwice<'a>(&'a Bench);

impl Progress for BuildTwice<'_> {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        for resume in [false, true] {
            let second = self.0.build(&BuildOptions { resume, ..self.0.options.clone() }, &());
            let error = second.unwrap_err().to_string();
            assert!(error.contains("out.vastex: another build is writing this file"), "{error}");
        }
        ControlFlow::Continue(())
    }
}

#[test]
fn the_second_of_two_builds_into_one_place_is_refused() {
    let bench = Bench::new([300, 260], pages_of(16));
    let report = bench.build(&bench.options, &BuildTwice(&bench)).unwrap();
    bench.expect_whole(&report);
}

#[test]
fn a_journal_that_cannot_be_written_is_an_error_that_names_it() {
    let bench = Bench::new([300, 260], pages_of(16));
    fs::create_dir(&bench.left()[1]).unwrap();
    for resume in [false, true] {
        let error = bench.build(&BuildOptions { resume, ..bench.options.clone() }, &()).unwrap_err();
        assert!(error.to_string().contains(".out.vastex.journal: cannot be written"), "{error}");
        bench.expect_names(&[".out.vastex.journal", "in.png"]);
    }
}

#[test]
fn tiles_that_are_aligned_are_gone_on_with_too() {
    let mut dice = Dice(4);
    for align in [4096, 1 << 16] {
        let bench = Bench::new([300, 260], BuildOptions { align, ..pages_of(32) });
        bench.interrupt(260);
        let left = bench.left().map(|path| fs::read(path).unwrap());
        for case in 0..16 {
            for (path, bytes) in bench.left().iter().zip(&left) {
                fs::write(path, bytes).unwrap();
            }
            let [partial, journal] = bench.left();
            match case % 3 {
                0 => {}
                // Often in the gaps before the tiles.
                1 => damage(&partial, &mut dice),
                _ => damage(&journal, &mut dice),
            }
            let report = bench.resume(1 + case % 3);
            assert!(case % 3 > 0 || report.resumed_tiles == report.tiles, "{report:?}");
            bench.expect_whole(&report);
        }
    }
    let bench = Bench::new([300, 260], BuildOptions { align: 4096, ..pages_of(32) });
    for rows in [40, 100, 230] {
        bench.interrupt(rows);
    }
    let other = BuildOptions { resume: true, ..pages_of(32) };
    let error = bench.build(&other, &()).unwrap_err().to_string();
    assert!(error.contains("other options"), "{error}");
    let report = bench.resume(2);
    assert!(report.resumed_tiles > 0, "{report:?}");
    bench.expect_whole(&report);
}

#[test]
fn parts_are_gone_on_with_too() {
    let mut dice = Dice(3);
    for (part, parts) in [(1, 1), (2, 3), (3, 3)] {
        let bench = Bench::new([300, 260], BuildOptions { part: PartOf::new(part, parts), ..pages_of(16) });
        bench.interrupt(260);
        let [partial, journal] = bench.left();
        let left = fs::read(&partial).unwrap();
        assert!(!journal.exists());
        for case in 0..30 {
            fs::write(&partial, &left).unwrap();
            if case > 0 {
                // Where the head is damaged, nobody knows whose part it is.
                let at = dice.below(left.len());
                match at < 300 || case % 2 == 0 {
                    true => fs::write(&partial, &left[..at]).unwrap(),
                    false => {
                        let mut flipped = left.clone();
                        flipped[at] ^= 1 << dice.below(8);
                        fs::write(&partial, flipped).unwrap();
                    }
                }
            }
            let report = bench.resume(1 + case % 2);
            assert!(case > 0 || report.resumed_tiles == report.tiles, "{report:?}");
            bench.expect_whole(&report);
        }
        fs::write(&partial, &left).unwrap();
        let other = BuildOptions { resume: true, linear: false, ..bench.options.clone() };
        let error = bench.build(&other, &()).unwrap_err().to_string();
        assert!(error.contains("of another image, part or options; build without --resume"), "{error}");
    }
}

fn set_time(path: &Path, time: SystemTime) {
    fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
}
