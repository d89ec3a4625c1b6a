//! Replays: the optimum against trying everything, what policies count, and what is refused.

use proptest::prelude::*;

use super::*;
use crate::texture::geometry::{Geometry, GeometrySpec};
use crate::texture::page::{Dims, PageId, PagePos};
use crate::wanted::feedback::WantedPage;

/// A trace over an image of 8x4 pages at level 0 and a level above, from rows of (level, x, y).
fn trace(frames: &[Vec<(u8, u32, u32)>]) -> Trace {
    let mut trace = Trace::new();
    let geometry = Geometry::new(GeometrySpec::image(1024, 512)).unwrap();
    let texture = trace.add_texture(geometry.clone()).unwrap();
    for frame in frames {
        let mut pages: Vec<WantedPage> = frame
            .iter()
            .map(|&(level, x, y)| {
                let level = level.min(geometry.tail_pos().level - 1);
                let [columns, rows, _] = geometry.level(level).pages;
                let pos = PagePos::new_2d(level, x % columns, y % rows);
                WantedPage { page: PageId::new(texture, Dims::D2, pos).unwrap(), pixels: 1, eighth: 0 }
            })
            .collect();
        pages.sort_unstable();
        pages.dedup();
        trace.add_frame(pages).unwrap();
    }
    trace
}

fn row(xs: impl IntoIterator<Item = u32>) -> Vec<(u8, u32, u32)> {
    xs.into_iter().map(|x| (0, x, 0)).collect()
}

fn run(trace: &Trace, policy: Policy, tiles: u64) -> Replay {
    replay(trace, &ReplaySettings::new(policy, PoolSize::Tiles(tiles))).unwrap()
}

/// The fewest loads with which any choice of victims plays the frames from `frame` on, ancestors free to go
/// or not.
fn fewest(
    pages: &Pages,
    slots: usize,
    frame: usize,
    resident: u32,
    memo: &mut rustc_hash::FxHashMap<(usize, u32), u64>,
) -> u64 {
    if frame == pages.sets().len() {
        return 0;
    }
    if let Some(&known) = memo.get(&(frame, resident)) {
        return known;
    }
    let set: u32 = pages.set(frame).iter().map(|&page| 1 << page).sum();
    let loads = u64::from((set & !resident).count_ones());
    let others = resident & !set;
    let keep = (slots - set.count_ones() as usize).min(others.count_ones() as usize);
    // Every subset of the others that may stay.
    let (mut best, mut subset) = (u64::MAX, others);
    loop {
        if subset.count_ones() as usize == keep {
            best = best.min(fewest(pages, slots, frame + 1, set | subset, memo));
        }
        if subset == 0 {
            break;
        }
        subset = (subset - 1) & others;
    }
    memo.insert((frame, resident), loads + best);
    loads + best
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn the_optimum_is_what_trying_everything_finds(
        frames in prop::collection::vec(prop::collection::vec((0u8..2, 0u32..4, 0u32..2), 1..3), 1..9),
        spare in 0u64..4,
    ) {
        let trace = trace(&frames);
        let pages = Pages::of(&trace);
        let tiles = pages.working_set_max() + spare;
        let slots = (tiles - pages.pins()) as usize;
        let best = fewest(&pages, slots, 0, 0, &mut Default::default());
        prop_assert_eq!(run(&trace, Policy::Lru, tiles).loads_optimum, best);
    }

    #[test]
    fn every_policy_counts_soundly_and_none_beats_the_optimum(
        frames in prop::collection::vec(prop::collection::vec((0u8..3, 0u32..8, 0u32..4), 0..6), 0..60),
        spare in 0u64..8,
        latency_frames in 0u64..3,
        tiles_per_frame in prop::option::of(1u64..4),
    ) {
        let trace = trace(&frames);
        let needed = Pages::of(&trace).working_set_max();
        for policy in Policy::ALL {
            let at_once = run(&trace, policy, needed + spare);
            prop_assert!(at_once.loads >= at_once.loads_optimum);
            prop_assert!(at_once.pages <= at_once.loads + 1);
            prop_assert_eq!((at_once.frames_to_full, at_once.wasted), (0, 0));
            prop_assert_eq!(at_once.missing_level_frames, 0.0);
            let settings = ReplaySettings {
                latency_frames,
                tiles_per_frame,
                ..ReplaySettings::new(policy, PoolSize::Tiles(needed + spare))
            };
            let timed = replay(&trace, &settings).unwrap();
            prop_assert!(timed.frames_to_full >= timed.frames_to_full_bound);
            for counted in [at_once, timed] {
                prop_assert!(counted.evictions <= counted.loads);
                prop_assert!(counted.reloads <= counted.loads);
                prop_assert!(counted.loads <= counted.evictions + counted.wasted + counted.pool_tiles + 64);
            }
        }
    }
}

#[test]
fn a_loop_that_does_not_fit_defeats_lru_and_not_the_optimum() {
    let frames: Vec<_> = (0..40).map(|frame| row([frame % 8])).collect();
    let trace = trace(&frames);
    let needed = Pages::of(&trace).working_set_max();
    let lru = run(&trace, Policy::Lru, needed + 2);
    assert!(lru.loads > lru.loads_optimum, "{lru:?}");
    assert_eq!(lru.loads - lru.reloads + 1, lru.pages);
    assert!(lru.ratio() > 1.1);
}

#[test]
fn a_pool_for_everything_loads_everything_once() {
    let trace = trace(&[row([0, 1]), row([4, 5]), row([0, 1])]);
    for policy in Policy::ALL {
        let all = run(&trace, policy, 100);
        assert_eq!((all.loads + 1, all.evictions, all.reloads), (all.pages, 0, 0), "{policy:?}");
        assert_eq!(all.ratio(), 1.0);
    }
}

#[test]
fn nonsense_is_refused() {
    let trace = trace(&[row([0, 1, 2])]);
    let needed = Pages::of(&trace).working_set_max();
    let refused = |pool| replay(&trace, &ReplaySettings::new(Policy::Lru, pool)).unwrap_err();
    assert_eq!(refused(PoolSize::Tiles(1)), ReplayError::PoolTooSmall { tiles: 1, needed });
    for share in [0.99, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(PoolSize::Share(share)), ReplayError::Share(_)), "{share}");
    }
    let settings =
        ReplaySettings { tiles_per_frame: Some(0), ..ReplaySettings::new(Policy::Lru, PoolSize::Share(1.0)) };
    assert_eq!(replay(&trace, &settings), Err(ReplayError::NoTiles));
    let empty = replay(&Trace::new(), &ReplaySettings::new(Policy::Vastex, PoolSize::Share(2.0))).unwrap();
    assert_eq!((empty.loads, empty.ratio()), (0, 1.0));
}

#[test]
fn latency_and_a_limit_of_tiles_delay_a_view_by_what_they_must() {
    let trace = trace(&vec![row([0, 1, 2, 3]); 12]);
    let pages = Pages::of(&trace).len() as u64;
    let timed = |latency_frames, tiles| {
        let settings = ReplaySettings {
            latency_frames,
            tiles_per_frame: Some(tiles),
            ..ReplaySettings::new(Policy::Vastex, PoolSize::Share(1.5))
        };
        replay(&trace, &settings).unwrap()
    };
    for (latency, tiles) in [(0, 1), (0, 2), (3, 1), (2, 100)] {
        let counted = timed(latency, tiles);
        let frames = pages.div_ceil(tiles) - 1 + latency;
        assert_eq!((counted.frames_to_full, counted.frames_to_full_bound), (frames, frames));
        assert!(frames == 0 || counted.missing_level_frames > 0.0);
    }
}
