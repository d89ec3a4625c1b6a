//! What the size of a pool and the number of textures do to loads, sharpness and the cost of deciding: the
//! five camera paths, swept, as tables and plots.

use std::collections::HashSet;
use std::time::Instant;

use bytes::Bytes;
use vastex_core::sim::{Path, View};
use vastex_core::{BiasRule, Budgets, Feedback, Geometry, GeometrySpec, PageId, Pager, TextureNumber};

use crate::micros;
use crate::plot::{Panel, Plot};

/// Pools in multiples of the largest working set of the path.
const POOLS: [f64; 9] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0];
const TEXTURES: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
/// The pool in the sweep of textures, in multiples of the working set of one.
const POOL_OF_TEXTURES: f64 = 2.0;
const FRAMES: u64 = 600;
const PICTURE: [u32; 2] = [1280, 720];
const TILE_BYTES: u64 = 64 << 10;
const TILES_PER_FRAME: u64 = 16;
/// So many that no path ever fills them.
const ENDLESS: u32 = 100_000;

/// What a run came to.
#[derive(Clone, Copy, Default)]
struct Run {
    loads: f64,
    /// Loads of tiles that had been loaded before.
    reloads: f64,
    /// Levels that a pixel lacks, on average over pixels and frames.
    levels_short: f64,
    /// In levels, on average over the frames.
    bias: f64,
    /// The median of the frames.
    micros: f64,
    wanted_most: u32,
}

pub(crate) fn measure() {
    println!("\n## Pools and textures, swept\n");
    println!(
        "The five camera paths of the simulated world, {FRAMES} frames each, a picture of {}x{} pixels, images of 32768x16384\n\
         texels; {TILES_PER_FRAME} tiles a frame, each a frame after it was asked for. Loads and reloads (of tiles that had been loaded before)\n\
         are summed over the paths; levels short, the mean over pixels and frames of the levels by which what is shown is\n\
         coarser than wanted, the bias and the time of a decision (the median of the frames) are means over the paths.\n",
        PICTURE[0], PICTURE[1]
    );
    let views: Vec<Vec<Feedback>> = Path::ALL.into_iter().map(|path| feedbacks(path, 1)).collect();
    let largest: Vec<u32> = views.iter().map(|views| play(views, 1, ENDLESS).wanted_most).collect();
    pools(&views, &largest);
    textures(&views, &largest);
}

fn pools(views: &[Vec<Feedback>], largest: &[u32]) {
    let runs = POOLS.map(|share| {
        let slots = largest.iter().map(|&largest| ((f64::from(largest) * share) as u32).max(2));
        views.iter().zip(slots).map(|(views, slots)| play(views, 1, slots)).collect()
    });
    println!("The pool in multiples of the path's largest working set:\n");
    show("pool / working set", &POOLS.map(|share| share.to_string()), &runs, "bench-decide-pools.svg");
}

fn textures(one: &[Vec<Feedback>], largest: &[u32]) {
    let runs = TEXTURES.map(|count| {
        let run = |((path, one), &largest): ((Path, &Vec<Feedback>), &u32)| {
            let slots = (f64::from(largest) * POOL_OF_TEXTURES) as u32;
            match count {
                1 => play(one, count, slots),
                _ => play(&feedbacks(path, count), count, slots),
            }
        };
        Path::ALL.into_iter().zip(one).zip(largest).map(run).collect()
    });
    println!(
        "\nTextures that share the picture in strips, and one pool of {POOL_OF_TEXTURES} times the working set of one. Of more textures more\n\
         pages lie on the edges of what is seen, so more are wanted.\n"
    );
    show("textures", &TEXTURES.map(|count| count.to_string()), &runs, "bench-decide-textures.svg");
}

/// Prints a table of [step][path], and writes a plot.
fn show(x_title: &'static str, steps: &[String], runs: &[Vec<Run>], name: &str) {
    println!(
        "| {x_title} | wanted at most | loads | reloads | levels short | bias, levels | µs a decision |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (step, runs) in steps.iter().zip(runs) {
        let sum = |of: fn(&Run) -> f64| runs.iter().map(of).sum::<f64>();
        let mean = |of| sum(of) / runs.len() as f64;
        println!(
            "| {step} | {} | {} | {} | {:.3} | {:.2} | {:.0} |",
            runs.iter().map(|run| run.wanted_most).max().unwrap_or(0),
            sum(|run| run.loads),
            sum(|run| run.reloads),
            mean(|run| run.levels_short),
            mean(|run| run.bias),
            mean(|run| run.micros),
        );
    }
    let panel = |title, of: fn(&Run) -> f64| Panel {
        title,
        lines: (0..Path::ALL.len()).map(|path| runs.iter().map(|runs| of(&runs[path])).collect()).collect(),
    };
    let plot = Plot {
        x_title,
        steps: steps.to_vec(),
        names: Path::ALL.map(|path| format!("{path:?}").to_lowercase()).to_vec(),
        panels: vec![
            panel("loads", |run| run.loads),
            panel("reloads", |run| run.reloads),
            panel("levels short of what is wanted", |run| run.levels_short),
            panel("mip bias, levels", |run| run.bias),
            panel("µs a decision", |run| run.micros),
        ],
    };
    plot.write(name);
    println!("\n![Loads, reloads, levels short, bias and time against {x_title}]({name})");
}

/// What is seen along a path of so many textures, each through a strip of the picture.
fn feedbacks(path: Path, count: u32) -> Vec<Feedback> {
    let geometry = geometry();
    let of_frame = |frame| {
        let view = path.view(frame);
        let strip = View { width: view.width / f64::from(count), ..view };
        let mut all = Feedback { frame, ..Feedback::default() };
        for texture in (0..count).map(texture) {
            let seen = strip.feedback(texture, &geometry, [PICTURE[0] / count, PICTURE[1]], frame, false);
            all.pages.extend(seen.pages); // in the order of the textures, and so ascending
        }
        all
    };
    (0..FRAMES).map(of_frame).collect()
}

fn play(views: &[Feedback], count: u32, slots: u32) -> Run {
    let mut pager = Pager::new(Budgets {
        upload_bytes_per_frame: TILES_PER_FRAME * TILE_BYTES,
        in_flight_bytes: 2 * TILES_PER_FRAME * TILE_BYTES,
    });
    let pool = pager.add_pool(slots.max(count + 1), TILE_BYTES, Some(BiasRule::Solved)).unwrap();
    let (geometry, tile) = (geometry(), Bytes::from_static(b"tile"));
    for n in 0..count {
        assert_eq!(pager.add_texture(pool, &geometry, None, None).unwrap().0, texture(n));
    }
    let (mut run, mut times) = (Run::default(), Vec::new());
    let (mut loaded, mut under_way, mut changes) = (HashSet::<PageId>::new(), Vec::new(), Vec::new());
    for feedback in views {
        let start = Instant::now();
        pager.begin_frame(feedback.frame);
        pager.observe(feedback);
        under_way.drain(..).for_each(|page| pager.tile_ready(page, tile.clone()));
        while let Some(page) = pager.poll_cancel() {
            pager.tile_cancelled(page);
        }
        while under_way.len() < TILES_PER_FRAME as usize
            && let Some(request) = pager.poll_request()
        {
            under_way.push(request.page);
        }
        let uploads = std::iter::from_fn(|| pager.poll_upload());
        run.reloads += uploads.filter(|(_, upload)| !loaded.insert(upload.page)).count() as f64;
        pager.take_table_changes(&mut changes);
        while pager.poll_event().is_some() {}
        times.push(start.elapsed());
        let stats = pager.stats();
        run.levels_short += stats.mean_levels_short() / FRAMES as f64;
        run.bias += f64::from(stats.bias_eighths) / 8.0 / FRAMES as f64;
        run.wanted_most = run.wanted_most.max(stats.wanted);
    }
    times.sort_unstable();
    Run { loads: pager.stats().loaded as f64, micros: micros(times[times.len() / 2]), ..run }
}

fn geometry() -> Geometry {
    Geometry::new(GeometrySpec::image(32_768, 16_384)).unwrap()
}

fn texture(number: u32) -> TextureNumber {
    TextureNumber::new(number as u16).unwrap()
}
