//! What a build of block-compressed tiles costs beside the bare encoder: both encode the same texels, of all
//! levels and borders, with the same number of threads: one, which leaves a processor for reading and
//! writing, and one for each processor. The build also reads the image, filters it, and writes. `cargo run
//! --release -p vastex-build --example block_speed -- IMAGE [ROUNDS [best]]`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement that is run by hand")]

mod clock;

use std::path::{Path, PathBuf};

use clock::{Took, median, time};
use ctt_bc7f::bindings as bc7f;
use intel_tex_2::{RgbaSurface, bc1};
use rayon::ThreadPool;
use rayon::prelude::*;
use vastex_build::{BuildOptions, Compression, LayerInput, Quality, build};
use vastex_core::{Description, LayerFormat, PagePos};
use vastex_tiles::{Container, TileSource, decode_blocks, decode_layer};

/// Bytes of a texel that is not compressed.
const TEXEL: usize = 4;
/// Texels of a block.
const BLOCK: usize = 16;
/// How fast a build must be beside the bare encoder, and how far its picture may be off, in dB.
const LEAST_SPEED: f64 = 0.7;
const MOST_OFF: f64 = 0.05;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let image = PathBuf::from(arguments.next().unwrap());
    let rounds = arguments.next().map_or(3, |rounds| rounds.parse().unwrap());
    let mut cases = vec![
        ("BC1", LayerFormat::Bc1Srgb, Quality::Normal),
        ("BC7 fast", LayerFormat::Bc7Srgb, Quality::Fast),
        ("BC7 normal", LayerFormat::Bc7Srgb, Quality::Normal),
    ];
    if arguments.next().is_some_and(|word| word == "best") {
        cases.push(("BC7 best", LayerFormat::Bc7Srgb, Quality::Best));
    }
    let bench = Bench::new(&image);
    println!(
        "{:.0} megatexels in {} tiles, {} processors, the median of {rounds} rounds.\n",
        bench.megatexels(),
        bench.pages.len(),
        thread_counts()[1]
    );
    println!(
        "| blocks | threads | bare Mtexel / CPU s | build Mtexel / CPU s | speed, CPU | busy | speed, wall | bare dB | build dB | at least {LEAST_SPEED}, wall |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for threads in thread_counts() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for (name, format, quality) in &cases {
            println!("| {name} | {threads} | {} |", bench.measure(*format, *quality, &pool, rounds));
        }
    }
}

/// One thread, and one for each processor.
fn thread_counts() -> [usize; 2] {
    [1, std::thread::available_parallelism().map_or(2, usize::from)]
}

/// The texels of an image as a container holds them.
struct Bench {
    image: PathBuf,
    dir: tempfile::TempDir,
    description: Description,
    pages: Vec<PagePos>,
    /// Those of all tiles, one below the other.
    texels: Vec<u8>,
}

impl Bench {
    fn new(image: &Path) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let raw = dir.path().join("raw.vastex");
        let options = BuildOptions { compression: Compression::None, ..BuildOptions::default() };
        build(&[layer(image, LayerFormat::Rgba8Srgb)], &raw, &options, &()).unwrap();
        let container = Container::open_file(&raw).unwrap();
        let description = (**container.description()).clone();
        let pages: Vec<_> = description.geometry.pages().collect();
        let tile = |pos: &PagePos| read(&container, *pos).to_vec();
        let texels = pages.iter().flat_map(tile).collect();
        Bench { image: image.into(), dir, description, pages, texels }
    }

    fn megatexels(&self) -> f64 {
        (self.texels.len() / TEXEL) as f64 / 1e6
    }

    /// A row of the table.
    fn measure(&self, format: LayerFormat, quality: Quality, pool: &ThreadPool, rounds: usize) -> String {
        let blocks_of_encoder = self.in_blocks(format);
        let mut blocks = vec![0; self.texels.len() / TEXEL / BLOCK * format.block_bytes()];
        let rounds: Vec<[Took; 2]> = (0..=rounds)
            .map(|_| {
                let encode = || self.encode(format, quality, &blocks_of_encoder, &mut blocks);
                [time(|| pool.install(encode)), self.build(format, quality, pool.current_num_threads())]
            })
            .skip(1)
            .collect();
        let of = |value: &dyn Fn(&[Took; 2]) -> f64| median(rounds.iter().map(value).collect());
        let [bare_db, build_db] = self.psnr(format, &blocks);
        let speed = of(&|[bare, build]| bare.wall / build.wall);
        let holds = speed >= LEAST_SPEED && (bare_db - build_db).abs() <= MOST_OFF;
        format!(
            "{:.0} | {:.0} | {:.2} | {:.2} | {speed:.2} | {bare_db:.2} | {build_db:.2} | {}",
            of(&|[bare, _]| self.megatexels() / bare.cpu),
            of(&|[_, build]| self.megatexels() / build.cpu),
            of(&|[bare, build]| bare.cpu / build.cpu),
            of(&|[_, build]| build.cpu / build.wall),
            if holds { "holds" } else { "DOES NOT HOLD" },
        )
    }

    /// The texels in the order in which the encoder wants them: row by row, or block by block.
    fn in_blocks(&self, format: LayerFormat) -> Vec<u8> {
        if format != LayerFormat::Bc7Srgb {
            return self.texels.clone();
        }
        let width = self.description.geometry.tile()[0] as usize;
        let mut blocks = Vec::with_capacity(self.texels.len());
        for rows in self.texels.chunks_exact(4 * width * TEXEL) {
            for x in (0..width).step_by(4) {
                for row in rows.chunks_exact(width * TEXEL) {
                    blocks.extend_from_slice(&row[x * TEXEL..(x + 4) * TEXEL]);
                }
            }
        }
        blocks
    }

    /// The encoder and nothing else, by the threads of the pool that this is called in.
    fn encode(&self, format: LayerFormat, quality: Quality, texels: &[u8], blocks: &mut [u8]) {
        let [width, height, _] = self.description.geometry.tile();
        let tile = width as usize * height as usize * TEXEL;
        let encode = |(texels, blocks): (&[u8], &mut [u8])| {
            let flags = match quality {
                Quality::Fast => bc7f::cPackBC7FlagDefaultFaster,
                Quality::Normal => bc7f::cPackBC7FlagDefault,
                Quality::Best => bc7f::cPackBC7FlagDefaultNonAnalytical,
            };
            if format == LayerFormat::Bc7Srgb {
                return ctt_bc7f::compress_blocks_into(texels, blocks, flags);
            }
            let (stride, height) = (width * TEXEL as u32, (texels.len() / TEXEL) as u32 / width);
            bc1::compress_blocks_into(&RgbaSurface { data: texels, width, height, stride }, blocks);
        };
        // So many tiles at once that calling the encoder costs nothing.
        let tiles = 64;
        let block_bytes = tile / TEXEL / BLOCK * format.block_bytes();
        texels.par_chunks(tiles * tile).zip(blocks.par_chunks_mut(tiles * block_bytes)).for_each(encode);
    }

    fn output(&self) -> PathBuf {
        self.dir.path().join("blocks.vastex")
    }

    fn build(&self, format: LayerFormat, quality: Quality, threads: usize) -> Took {
        let compression = Compression::None;
        let options = BuildOptions { quality, threads, compression, ..BuildOptions::default() };
        // Replacing the last one would be measured too. There is none before the first round.
        let _ = std::fs::remove_file(self.output());
        time(|| {
            build(&[layer(&self.image, format)], &self.output(), &options, &()).unwrap();
        })
    }

    /// Of the bare encoder's blocks, and of those in the container last built, against level 0.
    fn psnr(&self, format: LayerFormat, blocks: &[u8]) -> [f64; 2] {
        let container = Container::open_file(self.output()).unwrap();
        let geometry = &self.description.geometry;
        let [width, height, _] = geometry.tile();
        let tile = width as usize * height as usize * TEXEL;
        let block_bytes = tile / TEXEL / BLOCK * format.block_bytes();
        let tiles = self.texels.chunks_exact(tile).zip(blocks.chunks_exact(block_bytes));
        let (mut squares, mut count) = ([0.0; 2], 0u64);
        for (&pos, (texels, blocks)) in self.pages.iter().zip(tiles).filter(|(pos, _)| pos.level == 0) {
            let bare = decode_blocks(format, blocks, [width, height]);
            let built = decode_layer(container.description(), 0, &read(&container, pos));
            for at in self.payload(pos) {
                for (square, decoded) in squares.iter_mut().zip([&bare[..], &built[..]]) {
                    let off = |c: usize| f64::from(texels[at + c]) - f64::from(decoded[at + c]);
                    *square += (0..3).map(|c| off(c).powi(2)).sum::<f64>();
                }
                count += 3;
            }
        }
        squares.map(|square| 10.0 * (255.0 * 255.0 * count as f64 / square).log10())
    }

    /// Where the texels of a page that lie in the image begin in its tile.
    fn payload(&self, pos: PagePos) -> impl Iterator<Item = usize> {
        let geometry = &self.description.geometry;
        let ([page, ..], [border, ..], [side, ..]) = (geometry.page(), geometry.border(), geometry.tile());
        let [width, height] = [(pos.x, 0), (pos.y, 1)]
            .map(|(page_number, axis)| page.min(geometry.size()[axis] - page_number * page));
        (0..height)
            .flat_map(move |y| (0..width).map(move |x| ((y + border) * side + x + border) as usize * TEXEL))
    }
}

fn layer(image: &Path, format: LayerFormat) -> LayerInput {
    LayerInput { name: "color".into(), path: image.into(), format: Some(format), filter: None }
}

/// The bytes of a tile.
fn read(container: &Container, pos: PagePos) -> bytes::Bytes {
    pollster::block_on(container.read(pos)).unwrap().decode(container.description()).unwrap()
}
