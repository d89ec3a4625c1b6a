//! The part of `cargo xtask bench volumes` that reads: bricks with borders beside decoding the same chunks
//! alone, and boxes anywhere beside zarr-python and tensorstore.
//!
//! What reads is `crates/vastex-volume/benches/volumes.rs`. Seconds are of processors, and ratios are taken
//! within a round, since others may be at work on the same machine.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use super::words;
use crate::measure::{self, median};
use crate::shell;

/// How much of the speed of decoding alone bricks must have.
const LEAST_SHARE: f64 = 0.7;
/// How many times the work of `vastex-volume` that of the others must be.
const LEAST_OF_ZARR: f64 = 2.0;
const LEAST_OF_TENSORSTORE: f64 = 0.9;
/// Voxels of the stores along x, y and z (`stores.py`).
const STORE: [u64; 3] = [384, 384, 256];
/// Voxels of a box along each side.
const BOX: u64 = 64;
/// Boxes that lie anywhere, and passes over all of them.
const ANYWHERE: u64 = 300;

/// What boxes are called whose chunks no other box wants, and boxes by chance.
const ONCE: &str = "every chunk once";
const ANY: &str = "anywhere";

/// Places of those that we are measured against, in a round.
const ZARR: usize = 0;
const TENSORSTORE: usize = 1;
const DECODING: usize = 2;
const PASSES: &str = "3";
/// Bytes that a program may keep where it keeps anything.
const KEPT: u64 = 256 << 20;
const STORES: [&str; 12] = [
    "zstd-64-u16",
    "zstd-64-u8",
    "zstd-32-u16",
    "zstd-32-u8",
    "blosc-lz4-64-u16",
    "blosc-lz4-64-u8",
    "blosc-lz4-32-u16",
    "blosc-lz4-32-u8",
    "none-64-u16",
    "none-64-u8",
    "none-32-u16",
    "none-32-u8",
];
/// Voxels of a brick along each side.
const BRICKS: [u32; 2] = [64, 32];
const READ: [&str; 3] = ["zstd-64-u16", "blosc-lz4-64-u16", "zstd-64-u16-shards2"];
const SCRIPTS: [(&str, &str); 2] =
    [("stores.py", include_str!("../volumes/stores.py")), ("reads.py", include_str!("../volumes/reads.py"))];

/// A Python, and where its scripts and stores lie.
pub(super) struct Reading {
    python: PathBuf,
    scripts: PathBuf,
    stores: PathBuf,
    has_tensorstore: bool,
}

impl Reading {
    /// Writes the stores of a raw volume of 16 bits unless they are there.
    pub(super) fn new(
        python: &Path,
        has_tensorstore: bool,
        directory: &Path,
        (input, size): (&Path, [u32; 3]),
    ) -> Result<Reading> {
        for (name, text) in SCRIPTS {
            let path = directory.join(name);
            std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
        let stores = directory.join("volume-stores");
        if !stores.join("whole").exists() {
            println!("writing stores into {}", stores.display());
            std::fs::create_dir_all(&stores)?;
            let mut command = shell::command(&words(python));
            command.arg(directory.join("stores.py")).arg(input).args(size.map(|side| side.to_string()));
            shell::run(command.arg(&stores))?;
        }
        Ok(Reading { python: python.to_owned(), scripts: directory.to_owned(), stores, has_tensorstore })
    }

    /// The two sections.
    pub(super) fn page(&self, runs: usize) -> Result<String> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(self.assembly(threads, runs)? + &self.reads(runs)?)
    }

    /// Each in a process of its own: what an allocator keeps of one would be a gift to the next.
    fn assembly(&self, threads: usize, runs: usize) -> Result<String> {
        let mut rounds = Vec::new();
        for store in STORES {
            let path = words(&self.stores.join(store));
            // The first round fills the page cache.
            for round in 0..=runs {
                let alone = Work::read(&ours(&["alone", &threads.to_string(), &path])?)?;
                for brick in BRICKS {
                    let bricks =
                        Work::read(&ours(&["bricks", &threads.to_string(), &brick.to_string(), &path])?)?;
                    ensure!(
                        (bricks.chunks, bricks.bytes) == (alone.chunks, alone.bytes),
                        "{path}: {} chunks were decoded of {}",
                        bricks.chunks,
                        alone.chunks
                    );
                    if round > 0 {
                        rounds.push(Round { store, brick, alone, bricks });
                    }
                }
            }
        }
        assembly_table(&rounds, threads)
    }

    fn reads(&self, runs: usize) -> Result<String> {
        let lists = [(ONCE, "once.txt", 0, once()), (ANY, "anywhere.txt", KEPT, anywhere())];
        let mut rows = Vec::new();
        for (what, name, kept, places) in lists {
            let list = self.scripts.join(name);
            let text: String = places.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
            std::fs::write(&list, text).with_context(|| format!("cannot write {}", list.display()))?;
            for store in READ {
                let path = words(&self.stores.join(store));
                let mut rounds = Vec::new();
                for round in 0..=runs {
                    let of = |kind: &str| self.peer(kind, &path, &list, kept);
                    let zarr = of("zarr")?;
                    let tensorstore = if self.has_tensorstore { Some(of("tensorstore")?) } else { None };
                    let decoding = if kept == 0 { Some(of("decode")?.0) } else { None };
                    let ours = ours(&["reads", PASSES, &words(&list), &path, &kept.to_string()])?;
                    let ours = Ours::read(&ours)?;
                    for (who, sum) in
                        [("zarr-python", Some(zarr.1)), ("tensorstore", tensorstore.map(|(_, sum)| sum))]
                    {
                        ensure!(
                            sum.is_none_or(|sum| sum == ours.sum),
                            "{path}: {who} reads other values than vastex-volume"
                        );
                    }
                    if round > 0 {
                        let peers = [Some(zarr.0), tensorstore.map(|(cpu, _)| cpu), decoding];
                        rounds.push((peers, ours));
                    }
                }
                rows.push(Row { what, store, boxes: places.len(), rounds });
            }
        }
        reads_table(&rows)
    }

    /// CPU seconds of a pass, and the sum of its values.
    fn peer(&self, kind: &str, store: &str, list: &Path, kept: u64) -> Result<(f64, u64)> {
        let mut command = shell::command(&words(&self.python));
        command.arg(self.scripts.join("reads.py")).args([kind, store]).arg(list);
        let text = shell::output(command.args([PASSES, &kept.to_string()]))?;
        let fields: Vec<&str> = text.split_whitespace().collect();
        match fields[..] {
            [cpu, sum] => Ok((cpu.parse()?, sum.parse()?)),
            _ => bail!("{kind} printed '{text}'"),
        }
    }
}

/// What the benchmark of the crate prints.
fn ours(arguments: &[&str]) -> Result<String> {
    let mut command = shell::cargo("bench");
    command.args(["--quiet", "-p", "vastex-volume", "--features", "zstd", "--bench", "volumes", "--"]);
    shell::output(command.args(arguments))
}

/// Places that want every chunk of 64 voxels a side once, in an order by chance.
fn once() -> Vec<[u64; 3]> {
    let counts = STORE.map(|side| side / (2 * BOX));
    let mut places: Vec<[u64; 3]> = (0..counts.iter().product())
        .map(|n| [n % counts[0], n / counts[0] % counts[1], n / counts[0] / counts[1]])
        .map(|at| at.map(|at| at * 2 * BOX + BOX / 2))
        .collect();
    let mut numbers = Numbers(1);
    for n in (1..places.len()).rev() {
        places.swap(n, numbers.below(n as u64 + 1) as usize);
    }
    places
}

fn anywhere() -> Vec<[u64; 3]> {
    let mut numbers = Numbers(2);
    (0..ANYWHERE).map(|_| STORE.map(|side| numbers.below(side - BOX + 1))).collect()
}

/// The same numbers every time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % count
    }
}

/// What `volumes alone` and `volumes bricks` print.
#[derive(Clone, Copy, Debug)]
struct Work {
    chunks: u64,
    /// Bytes of these, decoded.
    bytes: f64,
    cpu: f64,
    wall: f64,
    /// How many there are; 0 of chunks alone.
    bricks: f64,
}

impl Work {
    fn read(text: &str) -> Result<Work> {
        let fields: Vec<&str> = text.split_whitespace().collect();
        let &[chunks, bytes, cpu, wall, ref rest @ ..] = &fields[..] else {
            bail!("the benchmark printed '{text}'");
        };
        Ok(Work {
            chunks: chunks.parse()?,
            bytes: bytes.parse()?,
            cpu: cpu.parse()?,
            wall: wall.parse()?,
            bricks: rest.first().map_or(Ok(0.0), |bricks| bricks.parse())?,
        })
    }
}

/// One round of a store and a size of bricks.
#[derive(Clone, Copy, Debug)]
struct Round {
    store: &'static str,
    brick: u32,
    alone: Work,
    bricks: Work,
}

fn says(holds: bool) -> &'static str {
    if holds { "holds" } else { "DOES NOT HOLD" }
}

fn assembly_table(rounds: &[Round], threads: usize) -> Result<String> {
    let mut page = format!(
        "\n## Bricks beside decoding alone\n\n\
         {}x{}x{} voxels of the same blobs, in OME-Zarr of two levels in a directory; of each of {threads} threads' chunks all are read and decoded, once\n\
         alone and once for bricks of 64 and of 32 voxels with a border of one, whose least and greatest values and histograms are kept. Every chunk is\n\
         decoded once in either, which the run checks, and kept. The share is decoded bytes for each CPU second of bricks, of that of decoding alone: medians\n\
         within a round. Each is measured in a process of its own, since memory that an allocator keeps of one would be a gift to the next. `none` has no\n\
         codec: what is called decoding is reading the file.\n\n{}\n\
         | codec, chunk, values | bricks of | decoded alone, MB per CPU s | for bricks | share | bricks per second |\n|---|---|---|---|---|---|\n",
        STORE[0],
        STORE[1],
        STORE[2],
        measure::stamp()?
    );
    let mut keys: Vec<(&str, u32)> = rounds.iter().map(|round| (round.store, round.brick)).collect();
    keys.sort_by_key(|(store, brick)| (STORES.iter().position(|of| of == store), u32::MAX - brick));
    keys.dedup();
    // Of codecs, and of what has none.
    let mut least: [Option<(f64, &str, u32)>; 2] = [None; 2];
    for (store, brick) in keys {
        let of: Vec<&Round> =
            rounds.iter().filter(|round| (round.store, round.brick) == (store, brick)).collect();
        let column = |value: &dyn Fn(&Round) -> f64| median(of.iter().map(|round| value(round)).collect());
        let share = column(&|round| round.alone.cpu / round.bricks.cpu);
        let [alone, together] = [
            column(&|round| round.alone.bytes / 1e6 / round.alone.cpu),
            column(&|round| round.bricks.bytes / 1e6 / round.bricks.cpu),
        ];
        let rate = column(&|round| round.bricks.bricks / round.bricks.wall);
        writeln!(page, "| {store} | {brick} | {alone:.0} | {together:.0} | {share:.2} | {rate:.0} |")?;
        let least = &mut least[usize::from(store.starts_with("none"))];
        if least.is_none_or(|(least, ..)| share < least) {
            *least = Some((share, store, brick));
        }
    }
    page.push('\n');
    for (what, least) in ["Of every codec", "Without a codec (`none`)"].into_iter().zip(least) {
        if let Some((share, store, brick)) = least {
            writeln!(
                page,
                "- {what} at least {LEAST_SHARE} of the speed of decoding alone: {} (least {share:.2}: {store}, bricks of {brick}).",
                says(share >= LEAST_SHARE)
            )?;
        }
    }
    Ok(page)
}

/// What `volumes reads` prints.
#[derive(Clone, Copy, Debug)]
struct Ours {
    cpu: f64,
    wanted: f64,
    read: f64,
    decoded: f64,
    sum: u64,
}

impl Ours {
    fn read(text: &str) -> Result<Ours> {
        let fields: Vec<&str> = text.split_whitespace().collect();
        let &[cpu, wanted, read, decoded, sum] = &fields[..] else {
            bail!("the benchmark printed '{text}'");
        };
        Ok(Ours {
            cpu: cpu.parse()?,
            wanted: wanted.parse()?,
            read: read.parse()?,
            decoded: decoded.parse()?,
            sum: sum.parse()?,
        })
    }
}

/// Boxes of one kind of one store.
struct Row {
    what: &'static str,
    store: &'static str,
    boxes: usize,
    /// CPU seconds of zarr-python, of tensorstore, and of decoding alone, and what is ours.
    rounds: Vec<([Option<f64>; 3], Ours)>,
}

impl Row {
    /// How many times `of` a round is, where it has that: the median.
    fn median(&self, of: impl Fn(&([Option<f64>; 3], Ours)) -> Option<f64>) -> Option<f64> {
        let found: Option<Vec<f64>> = self.rounds.iter().map(of).collect();
        found.filter(|found| !found.is_empty()).map(median)
    }

    /// How many times our work another's is.
    fn times(&self, peer: usize) -> Option<f64> {
        self.median(|(peers, ours)| Some(peers[peer]? / ours.cpu))
    }
}

fn reads_table(rows: &[Row]) -> Result<String> {
    let mut page = format!(
        "\n## Boxes of 64x64x64 voxels\n\n\
         `Volume::read` on one thread beside zarr-python and tensorstore with their own threads, in turn, from the same stores of 16 bits in the page cache;\n\
         all give the same sum of values. *Every chunk once*: {} boxes, each of eight parts of chunks that no other wants, so that nobody gains by what is\n\
         kept, and nobody keeps anything (`Volume::keep_at_most`). *Anywhere*: {ANYWHERE} boxes by chance; here vastex-volume keeps up to 256 MiB of chunks, as\n\
         it does unless told otherwise, tensorstore is given the same, and zarr-python keeps nothing. CPU seconds are of a pass over all boxes. Decoding alone is\n\
         what libzstd and c-blosc, called by numcodecs, take for the same chunks from memory into memory on one thread. Over-fetch: bytes that were\n\
         decoded for each byte that was wanted; with those that were read, which are compressed.\n\n\
         | boxes | store | vastex CPU s | zarr-python | tensorstore | decoding alone | decoded / wanted | read / wanted |\n|---|---|---|---|---|---|---|---|\n",
        once().len()
    );
    let times =
        |times: Option<f64>, none: &str| times.map_or(none.to_owned(), |times| format!("{times:.2} x"));
    for row in rows {
        let column =
            |of: &dyn Fn(&Ours) -> f64| median(row.rounds.iter().map(|round| of(&round.1)).collect());
        let peers = [0, 1, 2].map(|peer| row.times(peer));
        writeln!(
            page,
            "| {} ({}) | {} | {:.3} | {} | {} | {} | {:.2} | {:.2} |",
            row.what,
            row.boxes,
            row.store,
            column(&|ours| ours.cpu),
            times(peers[0], "not there"),
            times(peers[1], "not there"),
            times(peers[2], ""),
            column(&|ours| ours.decoded / ours.wanted),
            column(&|ours| ours.read / ours.wanted),
        )?;
    }
    let least = |peer: usize, what: Option<&str>| {
        rows.iter()
            .filter(|row| what.is_none_or(|what| row.what == what))
            .filter_map(|row| Some((row.times(peer)?, row)))
            .min_by(|one, other| one.0.total_cmp(&other.0))
    };
    if let Some((times, row)) = least(ZARR, Some(ANY)) {
        let holds = says(times >= LEAST_OF_ZARR);
        writeln!(
            page,
            "\n- Boxes anywhere: at most half of the CPU seconds of zarr-python: {holds} (least {times:.2} times: {}).",
            row.store
        )?;
    }
    if let Some((times, row)) = least(ZARR, Some(ONCE)) {
        // What libraries in C take for the chunks alone is a bound: nothing that decodes with them is faster.
        let most = row.median(|(peers, _)| Some(peers[ZARR]? / peers[DECODING]?));
        let most = most.map_or_else(String::new, |most| {
            format!("; who did nothing but decode, by the same library, would be {most:.2} times as fast")
        });
        writeln!(
            page,
            "- Boxes without what keeping gives: at most half of the CPU seconds of zarr-python: {} (least {times:.2} times: {}{most}).",
            says(times >= LEAST_OF_ZARR),
            row.store
        )?;
    }
    let of_tensorstore = match least(TENSORSTORE, None) {
        Some((least, row)) => {
            let holds = says(least >= LEAST_OF_TENSORSTORE);
            format!("{holds} (least {least:.2} times: {}, {})", row.store, row.what)
        }
        None => "not measured: tensorstore could not be installed".to_owned(),
    };
    writeln!(page, "- At most 1 / {LEAST_OF_TENSORSTORE} of those of tensorstore: {of_tensorstore}.")?;
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_that_want_every_chunk_once_want_every_chunk_once() {
        let mut wanted: Vec<[u64; 3]> = Vec::new();
        for at in once() {
            let chunks = |n: usize| [at[n] / BOX, at[n].div_ceil(BOX)];
            for (x, y, z) in (0..8).map(|n| (chunks(0)[n & 1], chunks(1)[n >> 1 & 1], chunks(2)[n >> 2])) {
                wanted.push([x, y, z]);
            }
        }
        let count = wanted.len() as u64;
        wanted.sort_unstable();
        wanted.dedup();
        assert_eq!((wanted.len() as u64, count), (count, STORE.map(|side| side / BOX).iter().product()));
        assert!(anywhere().iter().all(|at| (0..3).all(|n| at[n] + BOX <= STORE[n])));
    }

    #[test]
    fn the_slowest_codec_decides_and_reading_alone_is_told_by_itself() {
        let work = |cpu: f64| format!("144\t1000000\t{cpu}\t0.5\t10");
        let round = |store, alone| Round {
            store,
            brick: 64,
            alone: Work::read(&work(alone)).unwrap(),
            bricks: Work::read(&work(1.0)).unwrap(),
        };
        let rounds = [round("zstd-64-u8", 0.8), round("blosc-lz4-64-u8", 0.72), round("none-64-u8", 0.3)];
        let page = assembly_table(&rounds, 2).unwrap();
        assert!(page.contains("holds (least 0.72: blosc-lz4-64-u8"), "{page}");
        assert!(page.contains("| none-64-u8 | 64 | 3 | 1 | 0.30 | 20 |"), "{page}");
        assert!(page.contains("DOES NOT HOLD (least 0.30: none-64-u8"), "{page}");
        assert!(Work::read("nothing").is_err());
    }

    #[test]
    fn who_is_not_there_has_no_figure() {
        let ours = Ours::read("0.5\t100\t150\t800\t7").unwrap();
        let row_of = |what, tensorstore| Row {
            what,
            store: "a",
            boxes: 3,
            rounds: vec![([Some(1.5), tensorstore, Some(0.8)], ours)],
        };
        let row = |tensorstore| row_of(ANY, tensorstore);
        let page = reads_table(&[row(None), row_of(ONCE, None)]).unwrap();
        assert!(page.contains("zarr-python: holds (least 3.00 times: a)"), "{page}");
        assert!(page.contains("holds (least 3.00 times: a; who did nothing but decode, by"), "{page}");
        assert!(page.contains("| 3.00 x | not there | 1.60 x | 8.00 | 1.50 |"), "{page}");
        assert!(page.contains("could not be installed"), "{page}");
        let page = reads_table(&[row(Some(0.4))]).unwrap();
        assert!(page.contains("DOES NOT HOLD (least 0.80 times: a, anywhere)"), "{page}");
    }
}
