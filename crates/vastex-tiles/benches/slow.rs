//! What a disk cache is worth before a source that is slowed on purpose, and what it costs by itself.
//!
//! `cargo xtask bench slow`. Rates are of whole runs of the loader, since that is what a picture waits for.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark")]

use std::fs::File;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pollster::block_on;
use vastex_core::{Description, Dims, Geometry, GeometrySpec, LayerFormat, PageId, PagePos, TextureNumber};
use vastex_tiles::{
    Codec, DiskCache, DiskTier, Faults, Injection, Loader, ReadError, ReadFuture, SourceKey, Tile, TileSource,
};

const DELAY: Duration = Duration::from_millis(5);
/// Tiles that a run loads.
const TILES: usize = 500;
const THREADS: [usize; 3] = [1, 4, 16];
/// Tiles of 400 bytes, for what goes by their number.
const MANY: usize = 100_000;
const TURNS: usize = 9;
/// Of whole runs, which are long.
const RUNS: usize = 5;

fn main() {
    // Beside what is built: a directory for temporary files may lie in memory.
    let directory = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    runs(directory.path());
    costs(directory.path());
    numbers(directory.path());
}

/// Tiles out of thin air, no two alike.
struct Made(Arc<Description>);

impl Made {
    /// Pages of 128x128 or 10x10 texels of 4 bytes, borders included.
    fn new(page: u32, border: u32, across: u32) -> Made {
        let spec = GeometrySpec { page, border, ..GeometrySpec::image(across * page, across * page) };
        Made(Arc::new(Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::Rgba8)))
    }

    fn tile(&self, pos: PagePos) -> Tile {
        let first = pos.y << 16 | pos.x;
        let words = (0..self.0.tile_bytes() as u32 / 4).map(|n| (n ^ first).wrapping_mul(0x9e37_79b1));
        Tile { codec: Codec::Raw, bytes: words.flat_map(u32::to_le_bytes).collect() }
    }
}

impl TileSource for Made {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let exists = self.0.geometry.contains(pos);
        Box::pin(async move { if exists { Ok(self.tile(pos)) } else { Err(ReadError::NoSuchTile { pos }) } })
    }
}

fn large() -> Made {
    Made::new(120, 4, 40)
}

/// Pages of level 0 in an order that no read-ahead follows.
fn scattered(source: &Made, count: usize) -> Vec<PagePos> {
    let pages: Vec<PagePos> = source.0.geometry.pages_of_level(0).collect();
    (0..count).map(|n| pages[n * 1597 % pages.len()]).collect()
}

fn open(directory: &Path) -> Arc<DiskTier> {
    Arc::new(DiskTier::open(directory, 1 << 30).unwrap())
}

/// The same pages from the source alone, before an empty cache, and in a later run.
fn runs(directory: &Path) {
    println!(
        "{TILES} tiles of 64 KiB, each {} ms at its source; medians of {RUNS} runs\n",
        DELAY.as_millis()
    );
    println!(
        "| threads of the loader | no cache | first run | later run | later / no cache |\n|---|---|---|---|---|"
    );
    let pages = scattered(&large(), TILES);
    for threads in THREADS {
        let slow = || Faults::new(large(), |_, _| Some(Injection::Delay(DELAY)));
        let cache = directory.join(threads.to_string());
        let cached = || Arc::new(DiskCache::new(slow(), open(&cache), SourceKey::of("bench")));
        let rate = |source: Arc<dyn TileSource>| TILES as f64 / seconds(|| load(source, &pages, threads));
        let mut rates = [(); 3].map(|()| Vec::new());
        for _ in 0..RUNS {
            // One after the other: a directory belongs to one tier at a time.
            rates[0].push(rate(Arc::new(slow())));
            rates[1].push(rate(cached()));
            rates[2].push(rate(cached()));
            std::fs::remove_dir_all(&cache).unwrap();
        }
        let [none, first, later] = rates.map(median);
        println!(
            "| {threads} | {none:.0} tiles/s | {first:.0} tiles/s | {later:.0} tiles/s | {:.0} |",
            later / none
        );
    }
}

fn load(source: Arc<dyn TileSource>, pages: &[PagePos], threads: usize) {
    let texture = TextureNumber::new(0).unwrap();
    let mut loader = Loader::new(threads).unwrap();
    loader.add_source(texture, source);
    for (rank, &pos) in (0..).zip(pages) {
        loader.request(PageId::new(texture, Dims::D2, pos).unwrap(), rank);
    }
    while let Some(loaded) = loader.wait() {
        loaded.result.unwrap();
    }
}

/// Waits until what was read is on the disk.
fn keep_all(tier: &DiskTier) {
    assert!(tier.flush(Duration::from_secs(600)));
}

/// What a read costs on one thread, with all files in the system's cache.
fn costs(directory: &Path) {
    println!(
        "\none thread, tiles of 64 KiB, files in the page cache; medians of {TURNS} turns of {TILES} tiles\n"
    );
    println!("| what | a tile |\n|---|---|");
    let pages = scattered(&large(), TILES);
    // What waits to be kept is bounded, so it is kept every few tiles, and not counted: nobody who reads
    // waits for it.
    let read = |source: &dyn TileSource, tier: Option<&DiskTier>| {
        let time: f64 = pages
            .chunks(100)
            .map(|pages| {
                let read = |&pos| drop(black_box(block_on(source.read(pos)).unwrap()));
                let time = seconds(|| pages.iter().for_each(read));
                tier.into_iter().for_each(keep_all);
                time
            })
            .sum();
        time / TILES as f64 * 1e6
    };
    let mut times = [(); 4].map(|()| Vec::new());
    for turn in 0..TURNS {
        let cache = directory.join(format!("costs {turn}"));
        let tier = open(&cache);
        let cached = DiskCache::new(large(), tier.clone(), SourceKey::of("bench"));
        times[0].push(read(&large(), None));
        times[1].push(read(&cached, Some(&tier)));
        times[2].push(read(&cached, Some(&tier)));
        times[3].push(bare(&cache));
        drop((cached, tier));
        std::fs::remove_dir_all(&cache).unwrap();
    }
    let [made, missed, hit, bare] = times.map(median);
    println!("| a hit | {hit:.1} us |");
    println!("| the bare read of 64 KiB into fresh memory | {bare:.1} us |");
    println!("| what a miss adds to the source's read | {:.1} us |", missed - made);
}

/// Microseconds of a positioned read of one of the files that the cache wrote.
fn bare(cache: &Path) -> f64 {
    let files = std::fs::read_dir(cache).unwrap().map(|entry| entry.unwrap().path());
    let tiles = File::open(files.max_by_key(|path| path.metadata().unwrap().len()).unwrap()).unwrap();
    let most = tiles.metadata().unwrap().len() / 65_536;
    let time = seconds(|| {
        for n in 0..TILES as u64 {
            let mut bytes = vec![0; 65_536];
            read_exact_at(&tiles, &mut bytes, n * 97 % most * 65_536);
            black_box(&bytes);
        }
    });
    time / TILES as f64 * 1e6
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset).unwrap();
}

/// One read of a local file that has the bytes gives them all.
#[cfg(windows)]
fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) {
    assert_eq!(std::os::windows::fs::FileExt::seek_read(file, bytes, offset).unwrap(), bytes.len());
}

/// What goes by the number of tiles.
fn numbers(directory: &Path) {
    let cache = directory.join("many");
    let tier = open(&cache);
    let cached = DiskCache::new(Made::new(8, 1, 400), tier.clone(), SourceKey::of("bench"));
    let pages = scattered(&Made::new(8, 1, 400), MANY);
    let read = || {
        seconds(|| {
            for pages in pages.chunks(1000) {
                pages.iter().for_each(|&pos| drop(block_on(cached.read(pos)).unwrap()));
                keep_all(&tier);
            }
        })
    };
    let (first, later) = (read(), read());
    assert_eq!(tier.stats().skipped, 0);
    drop((cached, tier));
    let opening = seconds(|| drop(open(&cache)));
    let files = std::fs::read_dir(&cache).unwrap().count();
    let micros = |time: f64| time / MANY as f64 * 1e6;
    println!("\n{MANY} tiles of 400 bytes, in {files} files\n");
    println!("| what | time |\n|---|---|");
    println!("| reading and keeping them | {:.1} us a tile |", micros(first));
    println!("| reading them again | {:.1} us a tile |", micros(later));
    println!("| opening the cache in a later run | {:.0} ms |", opening * 1e3);
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
