//! Tiles from a cold disk, by a loader: direct reads beside buffered ones, with so many reads at once.
//!
//! Buffered reads take a thread each of those that the loader is told to have; of direct ones the container
//! says how many there may be, to a loader with its usual threads. `VASTEX_CONTAINER` names a container to
//! read instead of the one that is made; its tiles must be aligned.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustix::fs::{Advice, fadvise};
use vastex_core::{Description, Dims, Geometry, GeometrySpec, LayerFormat, PageId, PagePos, TextureNumber};
use vastex_tiles::{
    Compression, Container, ContainerWriter, EncodedTile, Loader, LoaderSettings, SystemClock, TileSource,
    WriterOptions,
};

use crate::{PAGE, median, scattered, seconds};

/// With its levels a file of 1.4 GB.
const SIDE: u32 = 128 * PAGE;
const TURNS: usize = 7;
const TILES_A_TURN: usize = 1000;
const READS: [usize; 6] = [1, 2, 4, 8, 16, 32];

pub(crate) fn measure() {
    // Beside what is built: a directory for temporary files may lie in memory.
    let directory = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = std::env::var_os("VASTEX_CONTAINER").map_or_else(
        || {
            let path = directory.path().join("cold.vastex");
            write(&path);
            path
        },
        PathBuf::from,
    );
    let file = File::open(&path).unwrap();
    // What is not on the disk yet cannot be dropped from the cache.
    file.sync_all().unwrap();
    let buffered = Arc::new(Container::open_file(&path).unwrap());
    let direct = READS.map(|reads| Arc::new(Container::open_file_direct(&path, reads).unwrap()));
    let megabytes = file.metadata().unwrap().len() as f64 / 1e6;
    let pages = scattered(&buffered);
    let tiles = TILES_A_TURN.min(pages.len());
    let kib = buffered.description().tile_bytes() / 1024;
    println!(
        "\ntiles of {kib} KiB, file of {megabytes:.0} MB on the disk alone, {TURNS} turns of {tiles} tiles at random; medians\n"
    );
    if !direct.iter().all(|direct| direct.is_direct()) {
        println!("(the file system refuses direct reads: what is called direct is buffered, too)\n");
    }
    println!("| reads at once | buffered | direct | ratio | CPU a tile, buffered | CPU a tile, direct |");
    println!("|---|---|---|---|---|---|");
    let mut next = 0;
    let mut measured = READS.map(|_| [(); 2].map(|()| (Vec::new(), Vec::new())));
    for _ in 0..TURNS {
        for ((reads, direct), measured) in READS.into_iter().zip(&direct).zip(&mut measured) {
            let usual = LoaderSettings { reads_at_once: reads, ..LoaderSettings::default() };
            let sides = [(&buffered, LoaderSettings { threads: reads, ..usual }), (direct, usual)];
            for ((container, settings), (rates, costs)) in sides.into_iter().zip(measured) {
                let range: Vec<_> = (next..next + tiles).map(|n| pages[n % pages.len()]).collect();
                next += tiles;
                fadvise(&file, 0, None, Advice::DontNeed).unwrap();
                let before = cpu_seconds();
                rates.push(tiles as f64 / seconds(|| load(container, &range, settings)));
                costs.push((cpu_seconds() - before) / tiles as f64 * 1e6);
            }
        }
    }
    for (reads, [buffered, direct]) in READS.into_iter().zip(measured) {
        let ratio =
            median(buffered.0.iter().zip(&direct.0).map(|(buffered, direct)| direct / buffered).collect());
        let rates = [buffered.0, direct.0].map(median);
        let costs = [buffered.1, direct.1].map(median);
        println!(
            "| {reads} | {:.0} tiles/s | {:.0} tiles/s | {ratio:.2} | {:.0} us | {:.0} us |",
            rates[0], rates[1], costs[0], costs[1]
        );
    }
}

/// User and system time of all threads so far.
fn cpu_seconds() -> f64 {
    /// Of those that Linux tells programs, whatever it counts in itself.
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    // The name, in brackets, may have any character.
    let fields: Vec<&str> = stat[stat.rfind(')').unwrap()..].split(' ').collect();
    fields[12..14].iter().map(|ticks| ticks.parse::<f64>().unwrap()).sum::<f64>() / TICKS_A_SECOND
}

/// Aligned tiles of 64 KiB, no two alike.
fn write(path: &Path) {
    let geometry = Geometry::new(GeometrySpec { page: PAGE, ..GeometrySpec::image(SIDE, SIDE) }).unwrap();
    let description = Arc::new(Description::one_layer(geometry, LayerFormat::Rgba8));
    let options = WriterOptions { align: 4096, compression: Compression::None, ..WriterOptions::default() };
    let mut writer = ContainerWriter::create(path, (*description).clone(), options).unwrap();
    for (n, pos) in (0u32..).zip(description.geometry.pages()) {
        let words =
            (0..description.tile_bytes() as u32 / 4).map(|i| (i ^ (n << 14)).wrapping_mul(0x9e37_79b1));
        let texels: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
        writer.append(pos, EncodedTile::new(texels.into(), &description, Compression::None)).unwrap();
    }
    writer.finish().unwrap();
}

/// All of the pages, read and decoded by a loader.
fn load(container: &Arc<Container>, pages: &[PagePos], settings: LoaderSettings) {
    let texture = TextureNumber::new(0).unwrap();
    let mut loader = Loader::with(settings, Arc::new(SystemClock::new())).unwrap();
    loader.add_source(texture, container.clone());
    for (rank, &pos) in (0..).zip(pages) {
        loader.request(PageId::new(texture, Dims::D2, pos).unwrap(), rank);
    }
    while let Some(loaded) = loader.wait() {
        loaded.result.unwrap();
    }
}
