//! A wall of many virtual textures: does a scene with 32 of them work as well as one? Measures what a frame
//! costs.
//!
//! `cargo run -p vastex-scenes --example wall -- 1 32` plays frames of 1280x720 pixels, shared out among so
//! many textures, each of 8192x4096 texels and all at the same scale, first while they move along and then at
//! rest, and prints a row for each number. The picture itself is not drawn. Costs are CPU time of the thread
//! that plays, where the system tells it (Linux), else wall time.

mod clock;
mod wall;

use anyhow::{Context, Result};
use vastex_scenes::{Gpu, headless_gpu};

use clock::Clock;
use wall::Wall;

/// Frames in each of the two states.
const FRAMES: u32 = 100;

/// What one state of the wall costs, per frame.
struct Cost {
    feedback_us: f64,
    update_us: f64,
    tiles: f64,
    table_bytes: f64,
    feedback_bytes: f64,
}

fn measure(wall: &mut Wall, first: u32, is_moving: bool) -> Result<Cost> {
    let (begin, mut clock) = (wall.textures.stats(), Clock::default());
    let (mut feedback, mut update) = (0.0, 0.0);
    for frame in 0..FRAMES {
        let at = if is_moving { first + frame } else { first };
        let times = wall.frame(at, &mut clock)?;
        feedback += times.feedback;
        update += times.update;
    }
    let end = wall.textures.stats();
    let each = |before: u64, after: u64| (after - before) as f64 / f64::from(FRAMES);
    Ok(Cost {
        feedback_us: 1e6 * feedback / f64::from(FRAMES),
        update_us: 1e6 * update / f64::from(FRAMES),
        tiles: each(begin.pager.loaded, end.pager.loaded),
        table_bytes: each(begin.table_bytes_sent, end.table_bytes_sent),
        feedback_bytes: each(begin.feedback_bytes_read, end.feedback_bytes_read),
    })
}

fn row(gpu: &Gpu, count: usize) -> Result<String> {
    let mut wall = Wall::new(gpu, count)?;
    let mut clock = Clock::default();
    for _ in 0..2000 {
        wall.frame(0, &mut clock)?;
        if wall.textures.stats().converged {
            break;
        }
    }
    let moving = measure(&mut wall, 0, true)?;
    for _ in 0..60 {
        wall.frame(FRAMES, &mut clock)?;
    }
    let still = measure(&mut wall, FRAMES, false)?;
    let stats = wall.textures.stats();
    let bias = f64::from(stats.pager.bias_eighths) / 8.0;
    Ok(format!(
        "| {count} | {} of {} | {bias} | {:.0} / {:.0} | {:.0} / {:.0} | {:.1} | {:.0} | {:.0} | {:.1} |",
        stats.pager.wanted,
        stats.pager.slots,
        moving.feedback_us,
        still.feedback_us,
        moving.update_us,
        still.update_us,
        moving.tiles,
        moving.table_bytes,
        moving.feedback_bytes,
        stats.table_bytes as f64 / 1024.0,
    ))
}

fn main() -> Result<()> {
    let counts: Vec<usize> = std::env::args()
        .skip(1)
        .map(|count| count.parse().with_context(|| format!("{count:?} is no number of textures")))
        .collect::<Result<_>>()?;
    let counts = if counts.is_empty() { vec![1, 2, 4, 8, 16, 32, 64] } else { counts };
    let gpu = headless_gpu()?;
    print(&format!("{}; costs per frame, moving / still\n", gpu.adapter_name()));
    print(
        "| textures | pages wanted | mip bias | feedback [µs] | update [µs] | tiles | table changes [B] | feedback [B] | \
         tables [KiB] |\n|---|---|---|---|---|---|---|---|---|",
    );
    for count in counts {
        print(&row(&gpu, count)?);
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "an example tells what it measures")]
fn print(text: &str) {
    println!("{text}");
}
