//! What feedback costs in each of its modes, beside the main pass, and what it brings back.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::{Context, Result};
use vastex::{FeedbackMode, GeometrySpec, Settings, TableChoice};
use vastex_scenes::{Path, Scene};

use crate::stage::Stage;
use crate::world::{Bench, Part, Verdict};

/// Per cent of a frame, on a GPU.
const ASKED: f64 = 5.0;
/// Of a frame's feedback where the GPU compacts it, in views of so few pages: 4,096 entries of 12 bytes, and
/// what stands before them.
const ASKED_KIB: f64 = 48.0 + 16.0 / 1024.0;

/// Places on the path.
const PLACES: [u64; 5] = [0, 60, 120, 180, 240];
/// Times that each is drawn with and without feedback, in turns.
const ROUNDS: u32 = 8;

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let size = if bench.gpu.is_processor() { [1280, 720] } else { [1920, 1080] };
    let mut page = format!(
        "## Feedback\n\nWhat it adds to a frame of {}x{}, compaction included, beside a main pass that tells nothing: medians over five\n\
         places of a flight over 65536x32768 texels. Asked for on a GPU: {ASKED} % of the frame by the cheapest mode, and 48 KiB and 16 bytes read back where it is compacted there.\n\n\
         | scene | mode | main pass ms | feedback ms | of the frame % | pages | read back B | of 12 B a page |\n|---|---|---|---|---|---|---|---|\n",
        size[0], size[1],
    );
    // The share of the cheapest mode, where it is largest.
    let mut share: f64 = 0.0;
    let mut compacted: f64 = 0.0;
    for scene in [Scene::Plane, Scene::Globe] {
        let mut cheapest = f64::INFINITY;
        // The main pass of a shader that tells nothing is what the others are measured by.
        let stage = |mode| {
            let settings = Settings { feedback: Some(mode), ..Settings::default() };
            Stage::new(bench, size, scene, settings, GeometrySpec::image(65536, 32768), TableChoice::BySize)
        };
        let mut plain = stage(FeedbackMode::Separate)?;
        for mode in FeedbackMode::ALL {
            let mut stage = stage(mode)?;
            let costs = PLACES.map(|frame| cost(frame, scene, &mut stage, &mut plain));
            let costs = costs.into_iter().collect::<Result<Vec<Cost>>>()?;
            let median = |of: &dyn Fn(&Cost) -> f64| {
                let mut values: Vec<f64> = costs.iter().map(of).collect();
                values.sort_by(f64::total_cmp);
                values[values.len() / 2]
            };
            let percent = median(&|cost| 1e2 * cost.feedback / (cost.main + cost.feedback));
            cheapest = cheapest.min(percent);
            if mode != FeedbackMode::Raw {
                compacted = compacted.max(median(&|cost| cost.bytes));
            }
            writeln!(
                page,
                "| {} | {} | {:.2} | {:.2} | {percent:.0} | {} | {} | {:.2} |",
                scene.name(),
                mode.name(),
                median(&|cost| 1e3 * cost.main),
                median(&|cost| 1e3 * cost.feedback),
                median(&|cost| cost.pages),
                median(&|cost| cost.bytes),
                median(&|cost| cost.bytes / (12.0 * cost.pages.max(1.0)))
            )?;
        }
        share = share.max(cheapest);
    }
    let what = "per cent of a frame that the cheapest feedback mode takes";
    let of_frame = Verdict::at_most(ASKED, what, share);
    let read_back = Verdict::at_most(ASKED_KIB, "KiB that compacted feedback reads back", compacted / 1024.0);
    Ok((page, vec![of_frame, read_back]))
}

/// What a frame took, in seconds, and brought back.
struct Cost {
    main: f64,
    feedback: f64,
    pages: f64,
    bytes: f64,
}

/// Draws a frame of the path again and again with its feedback, and beside it one that has none.
fn cost(frame: u64, scene: Scene, stage: &mut Stage<'_>, plain: &mut Stage<'_>) -> Result<Cost> {
    let pose = Path::Fly.pose(scene, 2.0, frame);
    stage.set_pose(&pose);
    plain.set_pose(&pose);
    let before = stage.textures.stats().feedback_bytes_read;
    stage.textures.ahead().trace().record();
    let (mut with, mut without) = (Duration::MAX, Duration::MAX);
    for _ in 0..ROUNDS {
        with = with.min(stage.draw(true)?);
        without = without.min(plain.draw(false)?);
    }
    let trace = stage.textures.ahead().trace().take()?.context("a trace was recorded")?;
    let frames = trace.frames().len().max(1) as f64;
    let pages = trace.frames().iter().map(Vec::len).sum::<usize>() as f64;
    let bytes = (stage.textures.stats().feedback_bytes_read - before) as f64;
    let feedback = with.saturating_sub(without).as_secs_f64();
    Ok(Cost {
        main: without.as_secs_f64(),
        feedback,
        pages: (pages / frames).round(),
        bytes: (bytes / frames).round(),
    })
}
