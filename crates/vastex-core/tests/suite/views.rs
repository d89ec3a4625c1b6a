//! How soon a view is complete, and at what price: after a cut, and while the camera stands.

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::sim::{Knobs, Path, World};
use vastex_core::{Event, ViewId};

/// Bytes of a tile.
const TILE: u64 = 100;

/// What keeps tiles from coming all at once.
#[derive(Clone, Copy, Debug)]
enum Limit {
    Uploads,
    Loader,
}

/// A world whose camera stands, where so many tiles can come in a frame.
fn world(
    limit: Limit,
    tiles_per_frame: u64,
    latency_frames: u64,
    slots: u32,
    complete_feedback: bool,
) -> World {
    let is_upload = matches!(limit, Limit::Uploads);
    let mut knobs = Knobs {
        complete_feedback,
        upload_bytes_per_frame: TILE * if is_upload { tiles_per_frame } else { 10_000 },
        tile_bytes: TILE,
        screen: [320, 180],
        slots,
        in_flight_tiles: 10_000,
        ..Knobs::new(Path::Still, 1)
    };
    knobs.loads.latency_frames = latency_frames;
    knobs.loads.tiles_per_frame = if is_upload { usize::MAX } else { tiles_per_frame as usize };
    World::new(knobs).unwrap()
}

/// Cuts, and plays until nothing new can be wanted any more; gives the tiles that came, and the frames until
/// the last that was missing had.
fn cut(world: &mut World, place: u64, is_declared: bool) -> (u64, u64) {
    world.cut_to(Path::Teleport.view(40 * place));
    if is_declared {
        world.pager.view_cut(ViewId::MAIN, world.frame + 1);
    }
    let before = world.pager.stats().loaded;
    let (mut frames, mut complete) = (0, 0);
    // Feedback is two frames old, and of a whole cycle after 16 more.
    while frames < complete.max(2) + u64::from(JITTER_CYCLE) + 1 {
        world.step().unwrap();
        frames += 1;
        if frames < 3 || world.pager.stats().missing > 0 {
            complete = frames + 1;
        }
        assert!(frames < 2000, "{:?}", world.pager.stats());
    }
    (world.pager.stats().loaded - before, complete)
}

#[test]
fn after_a_cut_a_view_is_complete_as_soon_as_the_budget_allows() {
    for (limit, tiles_per_frame, latency) in [
        (Limit::Uploads, 1, 1),
        (Limit::Uploads, 4, 0),
        (Limit::Uploads, 16, 3),
        (Limit::Loader, 4, 1),
        (Limit::Loader, 16, 8),
    ] {
        for complete_feedback in [true, false] {
            // With room for all of the views, and where each must do with less than it wants.
            for slots in [1000, 70] {
                let mut world = world(limit, tiles_per_frame, latency, slots, complete_feedback);
                for place in [1, 2, 4, 6, 7, 9] {
                    let (tiles, frames) = cut(&mut world, place, place % 2 == 1);
                    let bound = (1.1 * tiles.div_ceil(tiles_per_frame) as f64) as u64 + 2 + latency + 1;
                    let bound = bound + if complete_feedback { 0 } else { u64::from(JITTER_CYCLE) };
                    assert!(
                        frames <= bound,
                        "{frames} frames for {tiles} tiles, more than {bound}: {limit:?}, {tiles_per_frame} tiles a frame, latency {latency}, {slots} slots, place {place}, complete feedback: {complete_feedback}"
                    );
                    assert!(tiles > 10, "{tiles} tiles: the cut shows nothing new");
                }
            }
        }
    }
}

#[test]
fn with_a_still_view_no_tile_is_loaded_twice_in_any_pool() {
    for slots in (2..40).chain((40..200).step_by(10)) {
        for complete_feedback in [true, false] {
            let mut world = World::new(Knobs {
                slots,
                complete_feedback,
                screen: [320, 180],
                ..Knobs::new(Path::Still, 1)
            })
            .unwrap();
            world.run_until_converged(400).unwrap();
            for _ in 0..50 {
                world.step().unwrap();
            }
            let (stats, twice) =
                (world.pager.stats(), world.loads_of.values().filter(|&&loads| loads > 1).count());
            assert_eq!((twice, stats.missing), (0, 0), "{slots} slots: {stats:?}");
            let is_short = stats.wanted > slots * 9 / 10;
            assert_eq!(stats.bias_eighths > 0, is_short, "{slots} slots: {stats:?}");
            let says_so = world.events.iter().any(|(_, event)| matches!(event, Event::Oversubscribed { .. }));
            assert_eq!(says_so, is_short, "{slots} slots: {stats:?}");
        }
    }
}
