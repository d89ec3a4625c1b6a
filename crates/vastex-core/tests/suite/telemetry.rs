//! Telemetry in the simulated world: its frames add up to the pager's totals, whatever happens.

use vastex_core::sim::{Crowd, Knobs, Path, Random, World};
use vastex_core::{BiasRule, Budgets, GeometrySpec, History, PoolFrame, Region, Stats, TimeToSharp};

/// Frames of every pool, recorded as an application does.
struct Recorder {
    earlier: Vec<Stats>,
    history: History<PoolFrame>,
}

impl Recorder {
    fn new(crowd: &Crowd, frames: u64) -> Recorder {
        let earlier = crowd.pager.pools().map(|_| Stats::default()).collect();
        Recorder { earlier, history: History::new(frames) }
    }

    fn record(&mut self, crowd: &Crowd) {
        for (pager, earlier) in crowd.pager.pools().zip(&mut self.earlier) {
            self.history.push(crowd.frame, pager.frame_since(earlier));
            *earlier = pager.stats();
        }
    }
}

/// A few pools with textures that come and go, and a loader that is not to be relied on.
fn play(seed: u64, frames: u64) -> (Crowd, Recorder) {
    let mut random = Random::new(seed);
    let budgets = Budgets { upload_bytes_per_frame: 500 + random.below(4000), in_flight_bytes: 20_000 };
    let mut crowd = Crowd::new(budgets, [160, 90], seed);
    (crowd.loads.failing, crowd.loads.slow) = (0.1, 0.1);
    for _ in 0..3 {
        let pool = crowd
            .add_pool(
                5 + random.below(200) as u32,
                50 + random.below(200),
                random.chance(0.8).then_some(BiasRule::Solved),
            )
            .unwrap();
        let side = 500 + random.below(20_000) as u32;
        crowd.add(pool, GeometrySpec::image(side, side), Path::ALL[random.below(5) as usize]).unwrap();
        crowd.add(pool, GeometrySpec::image(side, 300), Path::ALL[random.below(5) as usize]).unwrap();
    }
    let mut recorder = Recorder::new(&crowd, frames);
    for frame in 0..frames {
        crowd.step().unwrap();
        if frame == frames / 2 {
            let gone = crowd.textures().nth(random.below(6) as usize).unwrap();
            crowd.remove(gone).unwrap();
        }
        recorder.record(&crowd);
    }
    (crowd, recorder)
}

#[test]
fn the_frames_add_up_to_the_totals() {
    for seed in 0..12 {
        let (crowd, recorder) = play(seed, 60);
        assert_eq!(recorder.history.iter().count(), 3 * 60);
        for pager in crowd.pager.pools() {
            let of_pool = || recorder.history.iter().filter(|frame| frame.pool == pager.pool());
            let sum = |count: fn(&Stats) -> u64| of_pool().map(|frame| count(&frame.stats)).sum::<u64>();
            let total = pager.stats();
            assert_eq!(sum(|stats| stats.loaded), total.loaded, "seed {seed}");
            assert_eq!(sum(|stats| stats.uploaded_bytes), total.uploaded_bytes);
            assert_eq!(sum(|stats| stats.evicted), total.evicted);
            assert_eq!(sum(|stats| stats.reloaded), total.reloaded);
            assert_eq!(sum(|stats| stats.requests), total.requests);
            assert_eq!(sum(|stats| stats.failures), total.failures);
            assert_eq!(sum(|stats| stats.cancelled), total.cancelled);
            assert_eq!(sum(|stats| stats.wasted), total.wasted);
            assert_eq!(sum(|stats| stats.waited_frames), total.waited_frames);
            let newest = recorder.history.newest().find(|frame| frame.pool == pager.pool()).unwrap();
            assert_eq!((newest.stats.occupied, newest.stats.wanted), (total.occupied, total.wanted));
            assert!(of_pool().all(|frame| frame.feedback_age == (frame.frame > 2).then_some(2)));
        }
    }
}

#[test]
fn what_is_measured_keeps_within_its_bounds() {
    for seed in 0..12 {
        for frame in play(seed, 60).1.history.iter() {
            let stats = &frame.stats;
            assert!(
                stats.tails <= stats.locked
                    && stats.locked <= stats.occupied
                    && stats.occupied <= stats.slots,
                "{frame:?}"
            );
            assert!(stats.wanted_at_bias <= stats.wanted && stats.pixels_at_wanted <= stats.pixels);
            assert!((0.0..=1.0).contains(&stats.share_at_wanted()));
            assert_eq!(stats.levels_short > 0, stats.pixels_at_wanted < stats.pixels, "{frame:?}");
            let sharp = frame.time_to_sharp.unwrap_or_default();
            assert!(sharp.p50 <= sharp.p95, "{frame:?}");
        }
    }
}

#[test]
fn a_fast_loader_makes_every_tile_sharp_after_its_latency() {
    for latency_frames in [1, 5] {
        let mut knobs = Knobs {
            upload_bytes_per_frame: 1 << 20,
            in_flight_tiles: 10_000,
            slots: 2000,
            ..Knobs::new(Path::Fly, 1)
        };
        (knobs.loads.latency_frames, knobs.loads.tiles_per_frame) = (latency_frames, usize::MAX);
        let mut world = World::new(knobs).unwrap();
        assert_eq!(world.pool().frame_since(&Stats::default()).time_to_sharp, None);
        (0..60).for_each(|_| world.step().unwrap());
        let frame = world.pool().frame_since(&Stats::default());
        let all = latency_frames as u32;
        assert_eq!(frame.time_to_sharp, Some(TimeToSharp { p50: all, p95: all }));
        assert_eq!(frame.stats.waited_frames, latency_frames * frame.stats.loaded);
    }
}

#[test]
fn a_view_that_has_converged_is_sharp_to_the_last_pixel() {
    let mut world = World::new(Knobs::new(Path::Still, 1)).unwrap();
    (0..4).for_each(|_| world.step().unwrap());
    let before = world.pager.stats();
    assert!(before.share_at_wanted() < 1.0 && before.mean_levels_short() > 0.0, "{before:?}");
    world.run_until_converged(200).unwrap();
    let after = world.pager.stats();
    assert_eq!((after.share_at_wanted(), after.mean_levels_short()), (1.0, 0.0), "{after:?}");
    // A pool that is too small shows what it lacks against mip bias 0.
    let mut small = World::new(Knobs { slots: 30, ..Knobs::new(Path::Still, 1) }).unwrap();
    small.run_until_converged(200).unwrap();
    let (stats, bias) = (small.pager.stats(), f64::from(small.pool().bias_eighths()) / 8.0);
    let short = stats.mean_levels_short();
    assert!((short - bias).abs() < 1.0 && short > 0.5, "{short} levels short at a bias of {bias}");
}

#[test]
fn what_is_pinned_by_hand_is_locked_while_it_is_there() {
    let budgets = Budgets { upload_bytes_per_frame: 800, in_flight_bytes: 3200 };
    let mut crowd = Crowd::new(budgets, [320, 180], 1);
    let pool = crowd.add_pool(400, 100, Some(BiasRule::Solved)).unwrap();
    let texture = crowd.add(pool, GeometrySpec::image(16_384, 8192), Path::Still).unwrap();
    (0..60).for_each(|_| crowd.step().unwrap());
    assert_eq!(crowd.pager.stats().locked, 1, "the tail");
    let region = Region::image(0..512, 0..512).on_levels(0..=0);
    let ticket = crowd.ask(texture, &region, None).unwrap();
    let pages = crowd.pager.progress(ticket).unwrap().pages;
    assert!(crowd.pager.stats().locked < 1 + pages, "most of it has yet to come");
    (0..60).for_each(|_| crowd.step().unwrap());
    let stats = crowd.pager.stats();
    assert_eq!((stats.locked, stats.tails), (1 + pages, 1), "{stats:?}");
    assert_eq!(crowd.pager.pool(pool).usage().locked, stats.locked);
    crowd.pager.release(ticket);
    crowd.step().unwrap();
    assert_eq!(crowd.pager.stats().locked, 1);
}
