//! The pager in the simulated world: what must hold for any camera, loader and pool.
//!
//! `World::step` itself checks the budgets, the evictions and the page table at every frame, and the `checks`
//! feature walks every structure after every step (of large pools, after some). `VASTEX_WORLDS` says how many
//! random worlds are played.

use bytes::Bytes;
use vastex_core::sim::{Knobs, Path, Random, World};
use vastex_core::{
    BiasRule, Budgets, Dims, Event, Feedback, GeometrySpec, PageId, PageState, Pager, PoolError, PoolFrame,
    PoolId, PoolPager, Progress, Region, Request, Slot, SlotUsage, Stats, TableChange, TextureNumber, Ticket,
    Upload, ViewId, WantedPage,
};

fn knobs(path: Path) -> Knobs {
    Knobs::new(path, 1)
}

fn failed(world: &World) -> usize {
    world.events.iter().filter(|(_, event)| matches!(event, Event::Failed { .. })).count()
}

#[test]
fn a_still_view_converges_and_stays_so() {
    let mut world = World::new(knobs(Path::Still)).unwrap();
    world.run_until_converged(200).unwrap();
    let loaded = world.pager.stats().loaded;
    for _ in 0..100 {
        world.step().unwrap();
        assert!(world.pager.is_converged());
    }
    let stats = world.pager.stats();
    assert_eq!(
        (stats.loaded, stats.missing, stats.in_flight, stats.bias_eighths),
        (loaded, 0, 0, 0),
        "{stats:?}"
    );
    let converged = world.events.iter().filter(|(_, event)| matches!(event, Event::Converged { .. }));
    assert_eq!(converged.count(), 1);
}

#[test]
fn every_path_converges_once_it_holds() {
    for path in Path::ALL {
        for slots in [40, 120, 400] {
            let mut world = World::new(Knobs { slots, hold_after: 150, ..knobs(path) }).unwrap();
            for _ in 0..150 {
                world.step().unwrap();
            }
            world.run_until_converged(300).unwrap_or_else(|why| panic!("{path:?}, {slots} slots: {why}"));
            assert_eq!(world.loads_under_way(), 0, "every request ends");
        }
    }
}

#[test]
fn an_upload_budget_below_one_tile_converges_later() {
    let run = |upload_bytes_per_frame| {
        let small = Knobs { upload_bytes_per_frame, screen: [160, 90], ..knobs(Path::Still) };
        World::new(small).unwrap().run_until_converged(2000).unwrap()
    };
    let (fast, slow) = (run(800), run(30));
    assert!(slow > fast, "{slow} frames at 30 bytes a frame, {fast} at 800");
}

#[test]
fn a_broken_tile_is_reported_once_retried_with_back_off_and_recovers() {
    let mut world = World::new(knobs(Path::Still)).unwrap();
    world.loads_mut().broken = 0.2;
    world.run_until_converged(400).unwrap();
    let (reported, stats) = (failed(&world), world.pager.stats());
    assert!(reported > 0 && stats.failed as usize == reported, "{stats:?}");
    let broken: Vec<_> = world.pager.failed_pages().collect();
    assert!(broken.iter().all(|&page| matches!(world.pager.state(page), PageState::Failed { .. })));
    let before = stats.failures;
    for _ in 0..400 {
        world.step().unwrap();
    }
    let retries = world.pager.stats().failures - before;
    assert!(retries >= 2 * reported as u64, "tried again: {retries}");
    assert!(retries <= 5 * reported as u64, "with back-off, not each frame: {retries}");
    assert_eq!(failed(&world), reported, "reported once");
    world.loads_mut().broken = 0.0;
    for _ in 0..1200 {
        world.step().unwrap();
    }
    let recovered = world.events.iter().filter(|(_, event)| matches!(event, Event::Recovered { .. })).count();
    assert_eq!((recovered, world.pager.stats().failed), (reported, 0));
}

#[test]
fn what_is_no_longer_wanted_is_called_off() {
    let mut world = World::new(knobs(Path::Teleport)).unwrap();
    world.loads_mut().latency_frames = 60;
    for _ in 0..400 {
        world.step().unwrap();
    }
    let stats = world.pager.stats();
    assert!(stats.cancelled > 0, "{stats:?}");
    every_request_ends_once(&world);
    // Where nothing is wanted any more, nothing is under way for long.
    world.hold();
    world.run_until_converged(1000).unwrap();
    every_request_ends_once(&world);
    assert_eq!((world.pager.stats().in_flight, world.loads_under_way()), (0, 0));
}

/// Loaded, failed, called off, come in vain, or not ended yet: each request is one of these.
fn every_request_ends_once(world: &World) {
    let stats = world.pager.stats();
    let ended = stats.loaded + stats.refreshed + stats.failures + stats.cancelled + stats.wasted;
    assert_eq!(stats.requests, ended + u64::from(stats.in_flight), "{stats:?}");
    assert!(world.loads_under_way() <= stats.in_flight as usize, "{stats:?}");
}

#[test]
fn a_pool_without_room_for_the_tail_is_refused() {
    let error = World::new(Knobs { slots: 1, ..knobs(Path::Still) }).unwrap_err();
    assert!(error.to_string().contains("2 are needed"), "{error}");
}

#[test]
fn the_same_world_plays_the_same_way() {
    let play = || {
        let mut world = World::new(Knobs { slots: 90, ..knobs(Path::Fly) }).unwrap();
        (world.loads_mut().failing, world.loads_mut().slow) = (0.1, 0.1);
        for _ in 0..200 {
            world.step().unwrap();
        }
        (world.pager.stats(), world.events)
    };
    assert_eq!(play(), play());
}

#[test]
fn volumes_and_odd_shapes_need_no_code_of_their_own() {
    for spec in [
        GeometrySpec { page: 254, ..GeometrySpec::image(7770, 10_001) },
        GeometrySpec { page: 100, border: 3, ..GeometrySpec::image(777, 10_000) },
        GeometrySpec::image(1, 1),
        GeometrySpec { dims: Dims::D3, size: [4000, 3000, 700], page: 60, ..GeometrySpec::image(1, 1) },
        GeometrySpec {
            dims: Dims::D3,
            size: [333, 4000, 5],
            page: 33,
            border: 2,
            ..GeometrySpec::image(1, 1)
        },
    ] {
        let mut world = World::new(Knobs { spec, ..knobs(Path::Still) }).unwrap();
        world.run_until_converged(200).unwrap();
    }
}

/// Random world 189 never came to rest: each frame of the jitter cycle saw other pages, and was taken for a
/// jump.
#[test]
fn pages_smaller_than_a_feedback_block_are_no_jumps() {
    let spec = GeometrySpec { page: 14, border: 1, ..GeometrySpec::image(3402, 8660) };
    let mut world =
        World::new(Knobs { spec, slots: 2000, screen: [477, 156], ..knobs(Path::Still) }).unwrap();
    world.run_until_converged(600).unwrap();
}

/// Where a page has no tile its nearest ancestor stands in: the view converges, and nothing is asked for in
/// vain.
#[test]
fn pages_without_tiles_are_never_asked_for() {
    for path in Path::ALL {
        for absent in [0.01, 0.3, 0.9] {
            let mut world = World::new(Knobs { absent, slots: 300, ..knobs(path) }).unwrap();
            for _ in 0..100 {
                world.step().unwrap();
            }
            world.hold();
            world.run_until_converged(400).unwrap();
        }
    }
}

/// A world in which everything is left to chance.
fn random_world(seed: u64) -> Result<(), String> {
    let mut random = Random::new(seed);
    let path = Path::ALL[random.below(5) as usize];
    let mut knobs = Knobs::new(path, seed);
    let up_to_power = |random: &mut Random, bits: std::ops::Range<u64>| {
        let power = bits.start + random.below(bits.end - bits.start);
        random.below(1 << power) as u32
    };
    knobs.spec = GeometrySpec {
        page: 8 + random.below(250) as u32,
        border: 1 + random.below(4) as u32,
        ..GeometrySpec::image(1 + up_to_power(&mut random, 4..16), 1 + up_to_power(&mut random, 4..16))
    };
    knobs.screen = [80 + random.below(400) as u32, 40 + random.below(200) as u32];
    knobs.slots = 2 + up_to_power(&mut random, 0..10);
    knobs.upload_bytes_per_frame = 20 + random.below(2000);
    knobs.in_flight_tiles = random.below(64);
    knobs.complete_feedback = random.chance(0.2);
    knobs.absent = if seed % 4 == 3 { 0.02 + 0.2 * random.below(4) as f64 } else { 0.0 };
    let loads = &mut knobs.loads;
    loads.latency_frames = random.below(20);
    loads.tiles_per_frame = 1 + random.below(40) as usize;
    // Not of the same chance, so that the rest of each world is as it would be.
    let mut other = Random::new(!seed);
    loads.lanes = [1 + other.below(4), 4 + other.below(30), 64, u64::MAX][other.below(4) as usize] as usize;
    knobs.lead_frames = if other.chance(0.5) { 1 + other.below(20) } else { 0 };
    (loads.broken, loads.failing, loads.slow) = match random.below(3) {
        0 => (0.0, 0.0, 0.0),
        1 => (0.05, 0.0, 0.1),
        _ => (0.0, 0.3, 0.3),
    };
    let mut world = World::new(knobs).map_err(|error| error.to_string())?;
    for _ in 0..120 {
        world.step()?;
    }
    // Whatever has gone wrong before, a view that is held and a loader that is well again come to rest.
    world.hold();
    let loads = world.loads_mut();
    (loads.broken, loads.failing, loads.slow) = (0.0, 0.0, 0.0);
    for _ in 0..20_000 {
        world.step()?;
        let stats = world.pager.stats();
        let at_rest =
            stats.in_flight == 0 && world.loads_under_way() == 0 && stats.missing + stats.failed == 0;
        if at_rest && world.pager.is_converged() {
            return Ok(());
        }
    }
    Err(format!("not at rest: {:?}", world.pager.stats()))
}

#[test]
fn random_worlds_hold_together() {
    let worlds = std::env::var("VASTEX_WORLDS").ok().and_then(|n| n.parse().ok()).unwrap_or(500);
    for seed in 0..worlds {
        random_world(seed).unwrap_or_else(|why| panic!("world {seed}: {why}"));
    }
}

/// "It never fails" is kept by the types: this does not compile once a step of the frame returns a `Result`.
/// That none of what a frame calls is left out is for the invariants of xtask to see.
#[test]
fn nothing_that_a_frame_does_can_fail() {
    let _: fn(&mut Pager, u64) = Pager::begin_frame;
    let _: fn(&mut Pager) -> Option<(Ticket, Progress)> = Pager::poll_ended;
    let _: fn(&mut Pager, &Feedback) = Pager::observe;
    let _: fn(&mut Pager, &[Feedback]) = Pager::observe_views;
    let _: fn(&mut Pager, &Feedback) = Pager::expect;
    let _: fn(&mut Pager, ViewId, u64) = Pager::view_cut;
    let _: fn(&mut Pager, PageId, Bytes) = Pager::tile_ready;
    let _: fn(&mut Pager, PageId, String) = Pager::tile_failed;
    let _: fn(&mut Pager, PageId) = Pager::tile_cancelled;
    let _: fn(&mut Pager) -> Option<PageId> = Pager::poll_cancel;
    let _: fn(&mut Pager) -> Option<Request> = Pager::poll_rerank;
    let _: fn(&mut Pager) -> Option<Request> = Pager::poll_request;
    let _: fn(&mut Pager) -> Option<(PoolId, Upload)> = Pager::poll_upload;
    let _: fn(&mut Pager, &mut Vec<TableChange>) = Pager::take_table_changes;
    let _: fn(&mut Pager) -> Option<Event> = Pager::poll_event;
    let _: fn(&Pager) -> bool = Pager::is_converged;
    let _: fn(&Pager, PageId) -> PageState = Pager::state;
    let _: fn(&Pager) -> Stats = Pager::stats;
    let _: fn(&mut Pager, TextureNumber, &Region) -> u32 = Pager::invalidate;
    let _: fn(&mut Pager) = Pager::tiles_lost;
    let _: fn(&mut Pager, Option<u64>) = Pager::feedback_under_way;
    let _: fn(&Pager) -> bool = Pager::is_short_of_bandwidth;
    let _: fn(&Pager) -> Option<u32> = Pager::arrival_frames;
    let _: fn(&Pager, &[Feedback]) -> Vec<WantedPage> = Pager::pages_of;
    let _: fn(&mut Pager, Event) = Pager::report;
    let _: fn(&mut Pager, PoolId, u64) = Pager::set_flight_bytes;
    let _: fn(&Pager, Ticket) -> Option<Progress> = Pager::progress;
    let _: fn(&Pager) -> u32 = Pager::feedback_cycle;
    let _: fn(&Pager, &Feedback) -> Feedback = Pager::of_members;
    let _: fn(&Pager, TextureNumber) -> Option<PoolId> = Pager::pool_of;
    let _: fn(&Pager, PoolId) -> &PoolPager = Pager::pool;
    // What these give has no name; that they give one after the other is their promise.
    let _ = |pager: &Pager| pager.pools().map(PoolPager::stats).last();
    let _ = |pager: &Pager| -> Vec<PageId> { pager.failed_pages().collect() };
    let _: fn(&PoolPager) -> u16 = PoolPager::bias_eighths;
    let _: fn(&PoolPager) -> PoolId = PoolPager::pool;
    let _: fn(&PoolPager) -> Vec<Option<SlotUsage>> = PoolPager::slots;
    let _: fn(&PoolPager, &Stats) -> PoolFrame = PoolPager::frame_since;
    let _: fn(&PoolPager, TextureNumber) -> Option<Slot> = PoolPager::tail_slot;
    let _: fn(&PoolPager, TextureNumber, &mut Vec<TableChange>) = PoolPager::resident_changes;
}

#[test]
fn a_texture_that_is_refused_leaves_everything_as_it_was() {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1, in_flight_bytes: 1 });
    let pool = pager.add_pool(3, 1, Some(BiasRule::Solved)).unwrap();
    let geometry = vastex_core::Geometry::new(GeometrySpec::image(1000, 1000)).unwrap();
    let mut add = || pager.add_texture(pool, &geometry, None, None);
    let numbers = [add(), add()].map(|added| added.unwrap().0.number());
    assert_eq!(numbers, [0, 1]);
    for _ in 0..3 {
        assert!(matches!(add(), Err(PoolError::TooSmall { needed: 4, .. })));
    }
    assert_eq!(pager.stats().occupied, 2);
    assert_eq!(pager.pool_of(TextureNumber::new(2).unwrap()), None, "no number was taken");
}
