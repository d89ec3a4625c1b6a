//! What reading volumes costs, in seconds of processor time: bricks with borders beside decoding the same
//! chunks alone, and boxes anywhere. `cargo xtask bench volumes` writes the stores, runs this beside other
//! programs and makes a page of what it prints.
//!
//! ```text
//! volumes alone THREADS STORE               every chunk of level 0, decoded: a line
//! volumes bricks THREADS SIDE STORE         every brick of level 0, of so many voxels a side: a line
//! volumes reads PASSES BOXES STORE KEPT     a line; BOXES is a file with the first voxel of a box a line,
//!                                           KEPT how many bytes of chunks are kept
//! ```

#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use bytes::Bytes;
use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::TileSource;
use vastex_volume::{ChunkWork, Opened, Volume, VolumeOptions, VolumeRegion, VolumeSource, open};

/// What has gone wrong, for people.
type Fault = String;

fn main() -> ExitCode {
    // Cargo adds a word of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["alone", threads, store] => number(threads).and_then(|threads| alone(store, threads)),
        ["bricks", threads, side, store] => bricks(store, side, threads),
        ["reads", passes, boxes, store, kept] => reads(passes, boxes, store, kept),
        // `cargo test --benches` runs it without words.
        _ => Ok(()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            println!("error: {fault}");
            ExitCode::FAILURE
        }
    }
}

fn number(word: &str) -> Result<usize, Fault> {
    word.parse().map_err(|_| format!("'{word}' is no number"))
}

fn volume(store: &str) -> Result<Arc<Volume>, Fault> {
    match open(Path::new(store)).map_err(|error| error.to_string())? {
        Opened::Volume(volume) => Ok(Arc::from(volume)),
        Opened::Images(_) => Err(format!("{store}: is a list of images")),
    }
}

/// Seconds of this process's threads on processors.
#[cfg(target_os = "linux")]
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 / 1e9
}

/// Where processor time is not asked for, time.
#[cfg(not(target_os = "linux"))]
fn cpu_seconds() -> f64 {
    static BEGIN: OnceLock<Instant> = OnceLock::new();
    BEGIN.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Processor and wall seconds of some work.
fn timed<T>(work: impl FnOnce() -> Result<T, Fault>) -> Result<(T, f64, f64), Fault> {
    let (wall, cpu) = (Instant::now(), cpu_seconds());
    let done = work()?;
    Ok((done, cpu_seconds() - cpu, wall.elapsed().as_secs_f64()))
}

/// Hands the numbers below `count` to threads; adds up what they give.
fn by_threads(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> Result<u64, Fault> + Sync,
) -> Result<u64, Fault> {
    let next = AtomicUsize::new(0);
    let run = || {
        let mut sum = 0;
        loop {
            let n = next.fetch_add(1, Ordering::Relaxed);
            if n >= count {
                return Ok(sum);
            }
            sum += work(n)?;
        }
    };
    std::thread::scope(|scope| {
        let runs: Vec<_> = (0..threads).map(|_| scope.spawn(run)).collect();
        runs.into_iter()
            .map(|run| run.join().unwrap_or_else(|_| Err("a thread panicked".into())))
            .sum::<Result<u64, Fault>>()
    })
}

/// Every chunk of level 0 alone: how many, their bytes, and CPU and wall seconds.
fn alone(store: &str, threads: usize) -> Result<(), Fault> {
    let volume = volume(store)?;
    let level = &volume.about().levels[0];
    let counts: [u64; 3] = std::array::from_fn(|axis| level.size[axis].div_ceil(level.chunk[axis]));
    let count = counts.iter().product::<u64>() as usize;
    // Who puts bricks together keeps them, too.
    let kept: Vec<OnceLock<Bytes>> = (0..count).map(|_| OnceLock::new()).collect();
    let (bytes, cpu, wall) = timed(|| {
        by_threads(threads, count, |n| {
            let place = n as u64;
            let at = [place % counts[0], place / counts[0] % counts[1], place / counts[0] / counts[1]];
            let chunk = block_on(volume.read_chunk(0, (0, 0), at)).map_err(|error| error.to_string())?;
            let chunk = chunk.ok_or_else(|| format!("{store}: the chunk at {at:?} is absent"))?;
            Ok(kept[n].get_or_init(|| black_box(chunk)).len() as u64)
        })
    })?;
    println!("{count}\t{bytes}\t{cpu:.6}\t{wall:.6}");
    Ok(())
}

/// Every brick of level 0, borders included: chunks that were decoded for them, their bytes, CPU and wall
/// seconds, and how many bricks there are.
fn bricks(store: &str, side: &str, threads: &str) -> Result<(), Fault> {
    let (side, threads) = (number(side)?, number(threads)?);
    let volume = volume(store)?;
    let options = VolumeOptions { brick: side as u32, ..VolumeOptions::default() };
    let source = VolumeSource::open(volume.clone(), &options).map_err(|error| error.to_string())?;
    let pages: Vec<PagePos> = source.description().geometry.pages_of_level(0).collect();
    // Opening reads the coarser level, of which others are made.
    let before = volume.chunk_work();
    let (_, cpu, wall) = timed(|| {
        by_threads(threads, pages.len(), |n| {
            let tile = block_on(source.read(pages[n])).map_err(|error| error.to_string())?;
            Ok(black_box(tile.bytes).len() as u64)
        })
    })?;
    let work = volume.chunk_work();
    let (decoded, bytes) = (work.decoded - before.decoded, work.bytes_decoded - before.bytes_decoded);
    println!("{decoded}\t{bytes}\t{cpu:.6}\t{wall:.6}\t{}", pages.len());
    Ok(())
}

/// Boxes of 64 voxels a side, all of them in each pass, of a volume that is opened anew: CPU seconds, bytes
/// of the boxes, bytes read and decoded for them, and a sum of all values, which other programs have, too.
fn reads(passes: &str, boxes: &str, store: &str, kept: &str) -> Result<(), Fault> {
    let (passes, kept) = (number(passes)?, number(kept)?);
    let text = std::fs::read_to_string(boxes).map_err(|error| format!("{boxes}: {error}"))?;
    let mut places = Vec::new();
    for line in text.lines() {
        let place: Vec<u64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        places.push(<[u64; 3]>::try_from(place).map_err(|_| format!("{boxes}: '{line}' is no place"))?);
    }
    let pass = |of_values: &mut dyn FnMut(Vec<u8>)| -> Result<ChunkWork, Fault> {
        let volume = volume(store)?;
        volume.keep_at_most(kept);
        for at in &places {
            let region = VolumeRegion { level: 0, channel: 0, time: 0, at: *at, size: [64; 3] };
            of_values(block_on(volume.read(&region)).map_err(|error| error.to_string())?);
        }
        Ok(volume.chunk_work())
    };
    let (mut sum, mut bytes) = (0_u64, 0);
    let work = pass(&mut |values| {
        bytes += values.len() as u64;
        sum = values
            .as_chunks::<2>()
            .0
            .iter()
            .fold(sum, |sum, value| sum.wrapping_add(u16::from_le_bytes(*value).into()));
    })?;
    let (_, cpu, _) = timed(|| {
        for _ in 0..passes {
            pass(&mut |values| drop(black_box(values)))?;
        }
        Ok(())
    })?;
    println!(
        "{:.6}\t{bytes}\t{}\t{}\t{sum}",
        cpu / passes.max(1) as f64,
        work.bytes_read,
        work.bytes_decoded
    );
    Ok(())
}
