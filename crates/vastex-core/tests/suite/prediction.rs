//! Prediction in the simulated world: what it gains where the camera moves, and that it costs nothing where
//! it is wrong or where there is no bandwidth to spare.

use vastex_core::checks;
use vastex_core::sim::{Knobs, Path, World};

const FRAMES: u64 = 400;

/// 400 frames of a path, without a prediction and with one of the view 8 frames ahead. A load takes 4 frames.
fn without_and_with(path: Path, change: impl Fn(&mut Knobs)) -> [World; 2] {
    [0, 8].map(|lead_frames| {
        let mut knobs = Knobs { lead_frames, slots: 900, ..Knobs::new(path, 3) };
        knobs.loads.latency_frames = 4;
        change(&mut knobs);
        let mut world = World::new(knobs).unwrap();
        (0..FRAMES).for_each(|_| world.step().unwrap());
        world
    })
}

#[test]
fn on_fly_and_spin_the_time_to_sharp_falls_by_a_third_at_equal_bandwidth() {
    for path in [Path::Fly, Path::Spin] {
        let worlds = without_and_with(path, |_| ());
        let [before, after] = [&worlds[0], &worlds[1]].map(|world| world.sharpness.mean());
        assert!(after <= before * 2.0 / 3.0, "{path:?}: {before} and {after} frames on average");
        let [before, after] = [&worlds[0], &worlds[1]].map(|world| world.sharpness.percentile(50));
        assert!(before >= 4 && after == 0, "{path:?}: {before} and {after} frames for half of the pages");
        let [before, after] = [&worlds[0], &worlds[1]].map(|world| world.sharpness.percentile(95));
        assert!(after <= before, "{path:?}: {before} and {after} frames for 95 % of the pages");
        let [before, after] = [&worlds[0], &worlds[1]].map(|world| world.pager.stats().loaded);
        assert!(after * 20 <= before * 21, "{path:?}: {before} and {after} loads");
    }
}

#[test]
fn a_prediction_that_is_wrong_or_cannot_be_afforded_costs_the_view_nothing() {
    // The camera jumps where nothing could have told; then there is less bandwidth than the view needs; then
    // no slot to spare.
    let short = |knobs: &mut Knobs| knobs.upload_bytes_per_frame = 200;
    let full = |knobs: &mut Knobs| knobs.slots = 150;
    let worlds = [
        ("jumps", without_and_with(Path::Teleport, |_| ())),
        ("short of bandwidth", without_and_with(Path::Spin, short)),
        ("full", without_and_with(Path::Spin, full)),
    ];
    for (name, [without, with]) in worlds {
        let [before, after] = [&without, &with].map(|world| world.sharpness.mean());
        assert!(after <= before * 1.02 + 0.02, "{name}: {before} and {after} frames on average");
    }
}

/// Of few loads at once, or of few tiles a frame, those in view come first, however many others were asked
/// for before.
#[test]
fn where_the_loader_has_few_lanes_a_prediction_costs_the_view_nothing() {
    for path in [Path::Fly, Path::Spin] {
        for (lanes, latency_frames) in [(32, 4), (16, 4), (8, 4), (32, 8), (4, 1), (2, 1)] {
            let [before, after] = [0, 8].map(|lead_frames| {
                let mut knobs = Knobs { lead_frames, slots: 900, ..Knobs::new(path, 3) };
                (knobs.loads.lanes, knobs.loads.latency_frames) = (lanes, latency_frames);
                let mut world = World::new(knobs).unwrap();
                let mut levels_short = 0.0;
                for _ in 0..FRAMES {
                    checks::paused(|| world.step().unwrap());
                    levels_short += world.pager.stats().mean_levels_short() / FRAMES as f64;
                }
                let (sharp, stats) = (&world.sharpness, world.pager.stats());
                println!(
                    "{path:?}, {lanes} lanes of {latency_frames} frames, {lead_frames} ahead: {:.2} frames, {} for half, {} for 95 %, \
                     {levels_short:.3} levels short, {} loads, {} ranked anew",
                    sharp.mean(),
                    sharp.percentile(50),
                    sharp.percentile(95),
                    stats.loaded,
                    world.reranked,
                );
                (sharp.mean(), levels_short)
            });
            assert!(after.0 <= before.0 * 1.02 + 0.02, "{path:?}: {before:?} and {after:?} frames");
            assert!(after.1 <= before.1 * 1.02, "{path:?}: {before:?} and {after:?} levels short");
        }
    }
}

#[test]
fn a_still_view_expects_what_it_has() {
    let [without, with] = without_and_with(Path::Still, |_| ());
    assert_eq!(without.pager.stats().loaded, with.pager.stats().loaded);
    assert!(with.pager.is_converged());
}
