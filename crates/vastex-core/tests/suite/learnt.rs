//! Prefetch sets in the simulated world: learnt on some ways along a path, used on another. docs/policies.md
//! has the figures.

use std::sync::Arc;

use vastex_core::sim::{Knobs, Path, World};
use vastex_core::{LearnSettings, PrefetchSets};

const FRAMES: u64 = 400;
/// Ways along the path that are learnt from, and the one that is measured.
const LEARNT_FROM: [u64; 3] = [11, 12, 13];
const MEASURED: u64 = 99;

fn knobs(path: Path) -> Knobs {
    let mut knobs = Knobs { slots: 900, stray: MEASURED, ..Knobs::new(path, 3) };
    knobs.loads.latency_frames = 4;
    knobs
}

fn sets(path: Path) -> Arc<PrefetchSets> {
    let traces = LEARNT_FROM.map(|stray| Knobs { stray, ..knobs(path) }.trace(FRAMES));
    Arc::new(PrefetchSets::learn(&traces, &LearnSettings::default()).unwrap())
}

fn run(knobs: Knobs) -> World {
    let mut world = World::new(knobs).unwrap();
    (0..FRAMES).for_each(|_| world.step().unwrap());
    world
}

/// The mean frames until a page is sharp.
struct Compared {
    nothing: f64,
    motion: f64,
    sets: f64,
    both: f64,
}

fn compared(name: &str, path: Path, sets: &Arc<PrefetchSets>, change: impl Fn(&mut Knobs)) -> Compared {
    let [nothing, motion, sets, both] =
        [(0, None), (8, None), (0, Some(sets)), (8, Some(sets))].map(|(lead_frames, sets)| {
            let mut knobs = Knobs { lead_frames, prefetch_sets: sets.cloned(), ..knobs(path) };
            change(&mut knobs);
            let world = run(knobs);
            let (mean, loads) = (world.sharpness.mean(), world.pager.stats().loaded);
            println!("{path:?}, {name}: {mean:.2} frames, {loads} loads");
            mean
        });
    Compared { nothing, motion, sets, both }
}

#[test]
fn what_was_learnt_on_other_ways_makes_views_sharp_sooner() {
    for path in Path::ALL {
        let sets = sets(path);
        let Compared { nothing, motion, sets, both } = compared("at ease", path, &sets, |_| ());
        let most = match path {
            // Motion tells nothing of a jump.
            Path::Teleport => (nothing / 4.0).min(motion / 4.0),
            Path::Fly | Path::Zoom => nothing * 2.0 / 3.0,
            Path::Still | Path::Spin => nothing * 0.75,
        };
        assert!(sets <= most, "{path:?}: {nothing} frames, {sets} with sets");
        assert!(both <= motion * 1.15, "{path:?}: {motion} frames, {both} with sets too");
    }
}

#[test]
fn where_bandwidth_or_slots_are_short_sets_cost_the_view_next_to_nothing() {
    for path in [Path::Fly, Path::Spin, Path::Teleport] {
        let sets = sets(path);
        let short = compared("short of bandwidth", path, &sets, |knobs| knobs.upload_bytes_per_frame = 200);
        let full = compared("full", path, &sets, |knobs| knobs.slots = 150);
        for Compared { nothing, sets, .. } in [short, full] {
            assert!(sets <= nothing * 1.05, "{path:?}: {nothing} frames, {sets} with sets");
        }
    }
}
