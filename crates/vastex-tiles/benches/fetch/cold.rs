//! Tiles from a cold disk: direct reads, so many in flight, beside buffered ones from as many threads.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use rustix::fs::{Advice, fadvise};
use vastex_core::{Description, Geometry, GeometrySpec, LayerFormat, PagePos};
use vastex_tiles::{Compression, Container, ContainerWriter, EncodedTile, TileSource, WriterOptions};

use crate::{PAGE, median, scattered, seconds};

/// With its levels a file of 1.4 GB.
const SIDE: u32 = 128 * PAGE;
const TURNS: usize = 7;
const TILES_A_TURN: usize = 1000;
const DEPTHS: [usize; 4] = [1, 4, 8, 16];

pub(crate) fn measure() {
    // Beside what is built: a directory for temporary files may lie in memory.
    let directory = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = directory.path().join("cold.vastex");
    write(&path);
    let file = File::open(&path).unwrap();
    // What is not on the disk yet cannot be dropped from the cache.
    file.sync_all().unwrap();
    let buffered = Container::open_file(&path).unwrap();
    let direct = DEPTHS.map(|depth| Container::open_file_direct(&path, depth).unwrap());
    let gigabytes = file.metadata().unwrap().len() as f64 / 1e9;
    println!(
        "\nfile of {gigabytes:.1} GB on the disk alone, {TURNS} turns of {TILES_A_TURN} tiles at random; medians\n"
    );
    if !direct.iter().all(Container::is_direct) {
        println!("(the file system refuses direct reads: what is called direct is buffered, too)\n");
    }
    println!("| reads at a time | buffered | direct | ratio |\n|---|---|---|---|");
    let pages = scattered(&buffered);
    let mut next = 0;
    let mut rates = DEPTHS.map(|_| (Vec::new(), Vec::new()));
    for _ in 0..TURNS {
        for ((depth, direct), rates) in DEPTHS.into_iter().zip(&direct).zip(&mut rates) {
            for (container, rates) in [(&buffered, &mut rates.0), (direct, &mut rates.1)] {
                let range: Vec<_> = (next..next + TILES_A_TURN).map(|n| pages[n % pages.len()]).collect();
                next += TILES_A_TURN;
                fadvise(&file, 0, None, Advice::DontNeed).unwrap();
                let bytes = (TILES_A_TURN * container.description().tile_bytes()) as f64;
                rates.push(bytes / 1e6 / seconds(|| read(container, &range, depth)));
            }
        }
    }
    for (depth, (buffered, direct)) in DEPTHS.into_iter().zip(rates) {
        let ratio =
            median(buffered.iter().zip(&direct).map(|(buffered, direct)| direct / buffered).collect());
        println!("| {depth} | {:.0} MB/s | {:.0} MB/s | {ratio:.2} |", median(buffered), median(direct));
    }
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

/// All of the pages, so many at a time.
fn read(container: &Container, pages: &[PagePos], at_a_time: usize) {
    std::thread::scope(|scope| {
        for part in pages.chunks(pages.len().div_ceil(at_a_time)) {
            scope.spawn(move || {
                for &pos in part {
                    std::hint::black_box(pollster::block_on(container.read(pos)).unwrap());
                }
            });
        }
    });
}
