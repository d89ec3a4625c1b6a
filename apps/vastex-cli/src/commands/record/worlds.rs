//! Worlds of one texture: what the pager decided, frame by frame; and what is learnt and replayed of the
//! traces of their cameras.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, anyhow};
use vastex_core::sim::{Knobs, Path as Way, Random, World};
use vastex_core::{
    BiasRule, Dims, GeometrySpec, HashedTable, Integrator, LearnSettings, Policy, PoolSize, PrefetchSets,
    ReplaySettings, TextureNumber, Trace, replay,
};

use super::{crowds, make, text, write};

/// Frames that a world lives.
const FRAMES: u64 = 120;
/// Pixels of the screen.
const SCREEN: [u32; 2] = [320, 180];

/// The names of the camera's ways.
const WAYS: [(&str, Way); 5] = [
    ("still", Way::Still),
    ("fly", Way::Fly),
    ("spin", Way::Spin),
    ("zoom", Way::Zoom),
    ("teleport", Way::Teleport),
];

/// Writes what there is to say of every world whose name begins so.
pub(super) fn record(directory: &Path, only: &str) -> Result<()> {
    make(directory)?;
    let is_wanted = |name: &str| name.starts_with(only);
    for (name, knobs, script) in worlds()? {
        if is_wanted(&name) {
            write(
                directory,
                &format!("{name}.txt"),
                live(knobs, script).map_err(|why| anyhow!("{name}: {why}"))?,
            )?;
        }
    }
    if is_wanted("hashed") {
        write(directory, "hashed.txt", hashed().map_err(|why| anyhow!(why))?)?;
    }
    crowds::record(directory, only)?;
    for (name, way) in WAYS {
        let name = format!("trace-{name}");
        if is_wanted(&name) {
            let trace = strayed(way, 0);
            write(directory, &format!("{name}.txt"), text::of_trace(&trace))?;
            write(directory, &format!("{name}.vxtrace"), trace.to_bytes())?;
            write(directory, &format!("{name}.sets.txt"), learnt(way)?)?;
            write(directory, &format!("{name}.replays.txt"), replays(&trace)?)?;
        }
    }
    Ok(())
}

/// What happens to a world before each of its frames.
type Script = fn(&mut World, u64);

/// Nothing does.
const NOTHING: Script = |_, _| ();

fn knobs(way: Way) -> Knobs {
    Knobs { screen: SCREEN, ..Knobs::new(way, 7) }
}

fn worlds() -> Result<Vec<(String, Knobs, Script)>> {
    let mut worlds = Vec::new();
    let mut add = |name: &str, knobs: Knobs, script: Script| worlds.push((name.to_owned(), knobs, script));
    for (name, way) in WAYS {
        add(&format!("one-{name}"), knobs(way), NOTHING);
        add(&format!("one-{name}-tight"), Knobs { slots: 40, ..knobs(way) }, NOTHING);
        let sets = Arc::new(sets(way)?);
        let far = |knobs: Knobs| with_latency(knobs, 4);
        add(&format!("one-{name}-predicted"), far(Knobs { lead_frames: 8, ..knobs(way) }), NOTHING);
        add(&format!("one-{name}-learnt"), far(Knobs { prefetch_sets: Some(sets), ..knobs(way) }), NOTHING);
    }
    let integrating = BiasRule::Integrating(Integrator::default());
    add("one-integrating", Knobs { slots: 60, bias_rule: integrating, ..knobs(Way::Fly) }, NOTHING);
    add("one-absent", Knobs { absent: 0.03, slots: 200, ..knobs(Way::Zoom) }, NOTHING);
    add("one-complete", Knobs { complete_feedback: true, ..knobs(Way::Spin) }, NOTHING);
    add("one-slow-upload", Knobs { upload_bytes_per_frame: 30, ..knobs(Way::Still) }, NOTHING);
    add("one-few-in-flight", Knobs { in_flight_tiles: 2, ..knobs(Way::Teleport) }, NOTHING);
    add("one-called-off", with_latency(knobs(Way::Teleport), 60), |world, _| world.loads_mut().lanes = 6);
    add("one-failing", Knobs { slots: 90, ..knobs(Way::Fly) }, |world, _| {
        (world.loads_mut().failing, world.loads_mut().slow) = (0.1, 0.1);
    });
    add("one-broken-and-mended", knobs(Way::Still), |world, frame| {
        world.loads_mut().broken = if frame < 60 { 0.2 } else { 0.0 };
    });
    add("one-cut", knobs(Way::Fly), |world, frame| {
        if frame == 50 {
            world.cut_to(Way::Teleport.view(90));
        }
    });
    let volume =
        GeometrySpec { dims: Dims::D3, size: [4000, 3000, 700], page: 60, ..GeometrySpec::image(1, 1) };
    add("one-volume", Knobs { spec: volume, ..knobs(Way::Fly) }, NOTHING);
    let odd = GeometrySpec { page: 100, border: 3, ..GeometrySpec::image(777, 10_000) };
    add("one-odd", Knobs { spec: odd, ..knobs(Way::Zoom) }, NOTHING);
    for seed in 0..24 {
        add(&format!("one-chance-{seed}"), by_chance(seed), NOTHING);
    }
    Ok(worlds)
}

fn with_latency(mut knobs: Knobs, frames: u64) -> Knobs {
    knobs.loads.latency_frames = frames;
    knobs
}

/// A world in which much is left to chance.
fn by_chance(seed: u64) -> Knobs {
    let mut random = Random::new(seed);
    let mut knobs = knobs(WAYS[random.below(5) as usize].1);
    let mut side = || 500 + random.below(60_000) as u32;
    knobs.spec = GeometrySpec::image(side(), side());
    (knobs.spec.page, knobs.spec.border) = (16 + random.below(240) as u32, 1 + random.below(4) as u32);
    knobs.slots = 20 + random.below(500) as u32;
    knobs.upload_bytes_per_frame = 20 + random.below(2000);
    knobs.in_flight_tiles = random.below(64);
    knobs.lead_frames = random.below(3) * 6;
    knobs.loads.latency_frames = random.below(20);
    knobs.loads.lanes = [1, 5, 20, 64][random.below(4) as usize];
    knobs.loads.tiles_per_frame = 1 + random.below(40) as usize;
    (knobs.loads.failing, knobs.loads.slow) = if random.chance(0.5) { (0.2, 0.2) } else { (0.0, 0.0) };
    knobs
}

fn live(knobs: Knobs, script: Script) -> Result<String, String> {
    let mut world = World::new(knobs).map_err(|error| error.to_string())?;
    world.begin_log();
    for frame in 1..=FRAMES {
        script(&mut world, frame);
        world.step()?;
    }
    Ok(ended(&mut world))
}

/// The lines of a world, with its counts at the end.
fn ended(world: &mut World) -> String {
    let (pool, counts) = (world.pool().pool(), world.pager.stats());
    world.log.counts(pool, &counts);
    let (reranked, sharp) = (world.reranked, world.sharpness.count());
    world.log.line(format_args!("reranked {reranked}"));
    world.log.line(format_args!("pages that became sharp {sharp} in {:.6} frames", world.sharpness.mean()));
    world.log.take()
}

/// A hashed table that is told what a world's table is told: where everything lies, every few frames.
fn hashed() -> Result<String, String> {
    let knobs = Knobs { slots: 1500, tile_bytes: 10, ..knobs(Way::Fly) };
    let mut world = World::new(knobs).map_err(|error| error.to_string())?;
    let mut table = HashedTable::new(0);
    let mut lines = String::new();
    for frame in 1..=FRAMES {
        if frame % 40 == 0 {
            world.cut_to(Way::Teleport.view(frame));
        }
        world.step()?;
        table.apply(world.table_changes());
        // Writing to a string cannot fail.
        let (pages, probe, seed) = (table.len(), table.longest_probe(), table.seed());
        let _ = writeln!(lines, "frame {frame} pages {pages} longest probe {probe} seed {seed}");
        if frame % 30 == 0 {
            for (place, words) in table.buckets().iter().map(|place| place.words()).enumerate() {
                if words[2] != u32::MAX {
                    let [low, high, entry] = words;
                    let _ = writeln!(lines, "place {place} {high:08x}{low:08x} {entry:08x}");
                }
            }
        }
    }
    Ok(lines)
}

/// The trace of a camera that strays from its way as another hand would.
fn strayed(way: Way, stray: u64) -> Trace {
    Knobs { stray, ..knobs(way) }.trace(FRAMES / 2)
}

fn sets(way: Way) -> Result<PrefetchSets> {
    let traces = [11, 12].map(|stray| strayed(way, stray));
    Ok(PrefetchSets::learn(&traces, &LearnSettings::default())?)
}

/// What was learnt, and what is expected where the camera comes by; the same from the file's bytes.
fn learnt(way: Way) -> Result<String> {
    let sets = sets(way)?;
    let [x, y, z] = sets.sides();
    let mut lines = format!("cells {} pages {} sides {x},{y},{z}\n", sets.cells(), sets.pages());
    let read = PrefetchSets::from_bytes(&sets.to_bytes())?;
    let textures: Vec<TextureNumber> = TextureNumber::new(0).into_iter().collect();
    for frame in (1..FRAMES / 2).step_by(6) {
        let [before, place] = [frame - 1, frame].map(|frame| knobs(way).view_in(frame).place());
        let step = std::array::from_fn(|axis| place[axis] - before[axis]);
        let expected = read.expected(place, step, &textures);
        anyhow::ensure!(expected == sets.expected(place, step, &textures), "the file says something else");
        // Writing to a string cannot fail.
        let _ = write!(lines, "frame {frame}\n{}", text::of_pages(&expected.pages, sets.geometries()));
    }
    Ok(lines)
}

/// The trace under every policy, in two pools.
fn replays(trace: &Trace) -> Result<String> {
    let mut lines = String::new();
    for policy in Policy::ALL {
        for (share, latency_frames, tiles_per_frame) in [(1.1, 0, None), (1.5, 3, Some(4))] {
            let pool = PoolSize::Share(share);
            let settings = ReplaySettings { policy, pool, latency_frames, tiles_per_frame };
            let replayed = replay(trace, &settings)?;
            let head = format!("{} in {share}", policy.name());
            for (what, count) in [
                ("frames", replayed.frames),
                ("pages", replayed.pages),
                ("largest-set", replayed.working_set_max),
                ("pool-tiles", replayed.pool_tiles),
                ("loads", replayed.loads),
                ("loads-optimum", replayed.loads_optimum),
                ("evictions", replayed.evictions),
                ("reloads", replayed.reloads),
                ("wasted", replayed.wasted),
                ("cuts", replayed.cuts),
                ("frames-to-full", replayed.frames_to_full),
                ("frames-to-full-bound", replayed.frames_to_full_bound),
            ] {
                // Writing to a string cannot fail.
                let _ = writeln!(lines, "{head} {what} {count}");
            }
            let _ = writeln!(lines, "{head} missing-level-frames {:.6}", replayed.missing_level_frames);
        }
    }
    Ok(lines)
}
