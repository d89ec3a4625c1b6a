//! What fetching a tile costs beside what cannot be avoided: a bare positioned read, and a bare decoder.
//!
//! `cargo xtask bench fetch`. The two sides take turns, so that a noisy machine slows both; ratios are
//! medians over the turns. Where there are direct reads, they are measured beside buffered ones from a cold
//! disk, too.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark")]

#[cfg(target_os = "linux")]
mod cold;

use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use vastex_core::{Description, Geometry, GeometrySpec, LayerFormat, PagePos};
use vastex_tiles::{Compression, Container, ContainerWriter, EncodedTile, TileSource, WriterOptions};

/// 64 KiB a tile: 128x128 texels of 4 bytes, borders included.
const PAGE: u32 = 120;
const SIDE: u32 = 60 * PAGE;
const TURNS: usize = 30;
const TILES_A_TURN: usize = 500;

fn main() {
    let directory = tempfile::tempdir().unwrap();
    println!("tiles of 64 KiB, {TURNS} turns of {TILES_A_TURN}, file in the page cache; medians\n");
    println!("| what | bare | vastex | ratio |\n|---|---|---|---|");
    for (name, compression) in
        [("raw", Compression::None), ("lz4", Compression::Lz4), ("zstd", Compression::Zstd(3))]
    {
        let path = directory.path().join(format!("{name}.vastex"));
        write(&path, compression);
        let container = Container::open_file(&path).unwrap();
        measure(name, &container, &path);
    }
    #[cfg(target_os = "linux")]
    cold::measure();
}

fn write(path: &std::path::Path, compression: Compression) {
    let geometry = Geometry::new(GeometrySpec { page: PAGE, ..GeometrySpec::image(SIDE, SIDE) }).unwrap();
    let description = Arc::new(Description::one_layer(geometry, LayerFormat::Rgba8));
    let options = WriterOptions { compression, ..WriterOptions::default() };
    let mut writer = ContainerWriter::create(path, (*description).clone(), options).unwrap();
    for (n, pos) in (0u32..).zip(description.geometry.pages()) {
        // Smooth shades with a little grain, which compress to about a half, as photographs do.
        let texels: Bytes = (0..description.tile_bytes() as u32)
            .map(|i| (i / 997 + n * 7) as u8 ^ ((i ^ n << 18).wrapping_mul(0x9e37_79b1) >> 29) as u8)
            .collect();
        writer.append(pos, EncodedTile::new(texels, &description, compression)).unwrap();
    }
    writer.finish().unwrap();
}

/// Pages of level 0 in an order that no read-ahead follows.
fn scattered(container: &Container) -> Vec<PagePos> {
    let pages: Vec<PagePos> = container.description().geometry.pages_of_level(0).collect();
    (0..pages.len()).map(|n| pages[n * 1597 % pages.len()]).collect()
}

fn measure(name: &str, container: &Container, path: &std::path::Path) {
    let pages = scattered(container);
    let tiles: Vec<_> = pages.iter().map(|&pos| pollster::block_on(container.read(pos)).unwrap()).collect();
    let file = std::fs::File::open(path).unwrap();
    let length = file.metadata().unwrap().len();
    let mut offset = 0;
    let mut read = (Vec::new(), Vec::new());
    let mut decode = (Vec::new(), Vec::new());
    for turn in 0..TURNS {
        let range: Vec<usize> = (0..TILES_A_TURN).map(|n| (turn * TILES_A_TURN + n) % pages.len()).collect();
        read.0.push(seconds(|| {
            for &n in &range {
                let mut bytes = vec![0; tiles[n].bytes.len()];
                read_exact_at(&file, &mut bytes, offset);
                std::hint::black_box(&bytes);
                offset = (offset + 1597 * 65_536) % (length - 65_536);
            }
        }));
        read.1.push(seconds(|| {
            for &n in &range {
                std::hint::black_box(pollster::block_on(container.read(pages[n])).unwrap());
            }
        }));
        let bytes = container.description().tile_bytes();
        decode.0.push(seconds(|| {
            for &n in &range {
                let mut out = vec![0; bytes];
                bare_decode(name, &tiles[n].bytes, &mut out);
                std::hint::black_box(&out);
            }
        }));
        decode.1.push(seconds(|| {
            for &n in &range {
                std::hint::black_box(tiles[n].decode(container.description()).unwrap());
            }
        }));
    }
    report(&format!("{name}: read, {} bytes a tile", tiles[0].bytes.len()), read);
    if name != "raw" {
        report(&format!("{name}: decode"), decode);
    }
}

#[cfg(unix)]
fn read_exact_at(file: &std::fs::File, bytes: &mut [u8], offset: u64) {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset).unwrap();
}

/// One read of a local file that has the bytes gives them all.
#[cfg(windows)]
fn read_exact_at(file: &std::fs::File, bytes: &mut [u8], offset: u64) {
    assert_eq!(std::os::windows::fs::FileExt::seek_read(file, bytes, offset).unwrap(), bytes.len());
}

fn bare_decode(codec: &str, bytes: &[u8], out: &mut [u8]) {
    match codec {
        "lz4" => drop(lz4_flex::block::decompress_into(bytes, out).unwrap()),
        "zstd" => drop(zstd::bulk::decompress_to_buffer(bytes, out).unwrap()),
        _ => {}
    }
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

fn report(what: &str, (bare, ours): (Vec<f64>, Vec<f64>)) {
    let ratio = median(bare.iter().zip(&ours).map(|(bare, ours)| bare / ours).collect());
    let micros = |values| median(values) / TILES_A_TURN as f64 * 1e6;
    println!("| {what} | {:.1} us | {:.1} us | {ratio:.2} |", micros(bare), micros(ours));
}
