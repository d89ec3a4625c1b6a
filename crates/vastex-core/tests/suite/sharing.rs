//! Pages of the same content share a load and a slot, in the simulated world.
//!
//! `Crowd::step` itself checks that every page leads to a slot with the content of the page that the table
//! names, and that nothing is loaded that is here or on its way; the `checks` feature counts the pages of
//! every slot after every step. `pools.rs` plays random crowds in which all of that happens at once.

use std::collections::BTreeSet;
use std::sync::Arc;

use bytes::Bytes;

use vastex_core::sim::{Crowd, Path, Random, contents_of_chance};
use vastex_core::{
    BiasRule, Budgets, Event, Feedback, Geometry, GeometrySpec, PageContents, PageId, PagePos, PageState,
    Pager, PoolId, PoolPager, Region, Slot, Stats, TextureNumber, TicketState, Urgency, ViewId, WantedPage,
};

const BUDGETS: Budgets = Budgets { upload_bytes_per_frame: 800, in_flight_bytes: 3200 };
const SPEC: GeometrySpec = GeometrySpec { page: 64, ..GeometrySpec::image(16384, 8192) };

/// Every page is black, but for those of which `is_other` says otherwise.
fn black_but(is_other: impl Fn(PagePos) -> bool) -> impl Fn(&Geometry) -> Option<PageContents> {
    move |geometry| {
        let number_of = |pos| (!is_other(pos)).then_some(0);
        Some(PageContents::new(geometry, vec![Bytes::from_static(b"black")], 1, number_of))
    }
}

/// A pool of so many slots, and a texture in it.
fn one_image(
    slots: u32,
    path: Path,
    contents: impl Fn(&Geometry) -> Option<PageContents>,
) -> (Crowd, TextureNumber) {
    let mut crowd = Crowd::new(BUDGETS, [320, 180], 1);
    let pool = crowd.add_pool(slots, 100, Some(BiasRule::Solved)).unwrap();
    let texture = crowd.add_with(pool, SPEC, path, contents).unwrap();
    (crowd, texture)
}

fn converge(crowd: &mut Crowd) -> Stats {
    crowd.hold();
    for _ in 0..600 {
        crowd.step().unwrap();
        if crowd.pager.is_converged() && crowd.is_up_to_date() {
            return crowd.pager.stats();
        }
    }
    panic!("not converged: {:?}", crowd.pager.stats());
}

fn resident(crowd: &Crowd) -> Vec<(PageId, Slot)> {
    crowd.pager.pools().flat_map(PoolPager::resident).collect()
}

#[test]
fn a_texture_of_one_color_needs_one_load_and_one_slot() {
    let stats = converge(&mut one_image(4, Path::Still, black_but(|_| false)).0);
    assert_eq!((stats.requests, stats.loaded, stats.uploaded_bytes), (1, 1, 100), "{stats:?}");
    assert_eq!((stats.occupied, stats.wanted, stats.bias_eighths), (2, 2, 0), "{stats:?}");
    assert!(stats.resident > 40 && u64::from(stats.resident) == stats.shared + 2, "{stats:?}");
    let alone = converge(&mut one_image(4, Path::Still, |_| None).0);
    assert!(alone.bias_eighths > 8, "{alone:?}");
}

#[test]
fn a_still_view_loads_each_content_once_whatever_the_pool() {
    let mut shared = 0;
    for slots in [6, 20, 50, 400] {
        for path in Path::ALL {
            let contents = |geometry: &Geometry| Some(contents_of_chance(geometry, 5, 0.7));
            let (mut crowd, _) = one_image(slots, path, contents);
            let stats = converge(&mut crowd);
            (0..100).for_each(|_| crowd.step().unwrap());
            let later = crowd.pager.stats();
            assert_eq!((later.loaded, later.requests), (stats.loaded, stats.requests), "{slots} {path:?}");
            assert_eq!(later.reloaded, 0, "{later:?}");
            shared += later.shared;
            let alone = converge(&mut one_image(slots, path, |_| None).0);
            assert!(stats.bias_eighths <= alone.bias_eighths, "{slots} {path:?}: {stats:?}, {alone:?}");
        }
    }
    assert!(shared > 300, "{shared}");
}

#[test]
fn constants_of_several_textures_are_one() {
    let (mut crowd, first) = one_image(6, Path::Still, black_but(|_| false));
    let second = crowd.add_with(PoolId::new(0), SPEC, Path::Spin, black_but(|_| false)).unwrap();
    let stats = converge(&mut crowd);
    assert_eq!((stats.loaded, stats.occupied, stats.tails), (1, 3, 2), "{stats:?}");
    crowd.remove(first).unwrap();
    let stats = converge(&mut crowd);
    assert_eq!((stats.loaded, stats.occupied, stats.tails), (1, 2, 1), "it stays for the other: {stats:?}");
    crowd.remove(second).unwrap();
    let stats = crowd.pager.stats();
    assert_eq!((stats.occupied, stats.resident), (0, 0), "{stats:?}");
}

/// The first texture was loading what both want when it was removed.
#[test]
fn what_a_removed_texture_was_loading_is_asked_for_anew() {
    let (mut crowd, first) = one_image(6, Path::Still, black_but(|_| false));
    crowd.loads.latency_frames = 20;
    (0..5).for_each(|_| crowd.step().unwrap());
    crowd.add_with(PoolId::new(0), SPEC, Path::Still, black_but(|_| false)).unwrap();
    (0..5).for_each(|_| crowd.step().unwrap());
    assert_eq!(crowd.pager.stats().requests, 1);
    crowd.remove(first).unwrap();
    let stats = converge(&mut crowd);
    assert_eq!((stats.requests, stats.loaded), (2, 1), "{stats:?}");
}

#[test]
fn a_page_whose_content_changes_leaves_the_others_without_a_hole() {
    let (mut crowd, texture) = one_image(200, Path::Still, black_but(|_| false));
    let before = converge(&mut crowd);
    let pages: BTreeSet<PageId> = resident(&crowd).into_iter().map(|(page, _)| page).collect();
    crowd.change(texture, &Region::image(5000..11_000, 2000..6000).on_levels(0..=6));
    assert!(!crowd.is_up_to_date());
    let frames = (1..200).find(|_| {
        crowd.step().unwrap();
        let now: BTreeSet<PageId> = resident(&crowd).into_iter().map(|(page, _)| page).collect();
        assert!(pages.is_subset(&now), "a page has gone");
        crowd.is_up_to_date()
    });
    let (stats, frames) = (converge(&mut crowd), frames.unwrap());
    assert!(frames > 1 && stats.refreshed > 3 && stats.evicted == 0, "{frames}: {stats:?}");
    assert_eq!(u64::from(stats.occupied), u64::from(before.occupied) + stats.refreshed, "a slot for each");
    assert_eq!(stats.resident, before.resident);
    crowd.change(texture, &Region::whole());
    let stats = converge(&mut crowd);
    assert!(stats.occupied + 1 >= stats.resident, "nobody shares any more: {stats:?}");
}

#[test]
fn a_small_pool_becomes_coarser_where_sharing_ends() {
    let (mut crowd, texture) = one_image(6, Path::Still, black_but(|_| false));
    assert_eq!(converge(&mut crowd).bias_eighths, 0);
    crowd.change(texture, &Region::whole());
    let stats = converge(&mut crowd);
    assert!(stats.bias_eighths > 0 && stats.occupied <= 6, "{stats:?}");
}

#[test]
fn one_content_fails_once_and_recovers() {
    let (mut crowd, texture) = one_image(40, Path::Still, black_but(|_| false));
    crowd.loads.broken = 1.0;
    let ticket = crowd.ask(texture, &Region::whole().on_levels(6..=6), None).unwrap();
    (0..60).for_each(|_| crowd.step().unwrap());
    let failed = |crowd: &Crowd| {
        crowd.events.iter().filter(|(_, event)| matches!(event, Event::Failed { .. })).count()
    };
    assert_eq!((failed(&crowd), crowd.pager.failed_pages().count()), (1, 1));
    assert!(crowd.pager.is_converged(), "a content that failed is answered");
    let progress = crowd.pager.progress(ticket).unwrap();
    assert_eq!((progress.failed, progress.state), (progress.pages, TicketState::Done));
    let geometry = Geometry::new(SPEC).unwrap();
    let page = PageId::new(texture, geometry.dims(), PagePos::new_2d(6, 0, 0)).unwrap();
    assert!(matches!(crowd.pager.state(page), PageState::Failed { .. }), "{:?}", crowd.pager.state(page));
    crowd.loads.broken = 0.0;
    (0..200).for_each(|_| crowd.step().unwrap());
    let recovered = crowd.events.iter().filter(|(_, event)| matches!(event, Event::Recovered { .. })).count();
    assert_eq!((failed(&crowd), recovered, crowd.pager.stats().failed), (1, 1, 0));
}

#[test]
fn a_prefetch_takes_no_slot_for_what_is_here_and_one_for_each_other_content() {
    let (mut crowd, texture) = one_image(12, Path::Still, black_but(|pos| pos.level == 3));
    crowd.loads.latency_frames = 3;
    converge(&mut crowd);
    let before = crowd.pager.stats();
    let region = Region::image(0..400, 0..400).on_levels(1..=1);
    crowd.ask(texture, &region, Some(Urgency::default())).unwrap();
    for _ in 0..40 {
        crowd.step().unwrap();
    }
    let (ticket, progress) = *crowd.ended.last().unwrap();
    assert_eq!((progress.state, progress.resident), (TicketState::Done, progress.pages), "{ticket:?}");
    let loaded = crowd.pager.stats().loaded - before.loaded;
    assert!(progress.pages > 10 && loaded <= 2, "{loaded} of {}", progress.pages);
}

#[test]
fn everything_is_loaded_again_after_the_device_is_lost() {
    let contents = |geometry: &Geometry| Some(contents_of_chance(geometry, 3, 0.8));
    let (mut crowd, _) = one_image(60, Path::Still, contents);
    let before = converge(&mut crowd);
    crowd.lose_device();
    let lost = crowd.pager.stats();
    assert_eq!((lost.occupied, lost.resident), (1, 1));
    let after = converge(&mut crowd);
    assert_eq!(after.loaded, 2 * before.loaded);
    assert_eq!((after.occupied, after.bias_eighths), (before.occupied, before.bias_eighths));
}

/// A pager with one texture, all of whose pages are black.
fn black_pager(slots: u32) -> (Pager, Geometry, TextureNumber) {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 10, in_flight_bytes: 10 });
    let pool = pager.add_pool(slots, 1, Some(BiasRule::Solved)).unwrap();
    let (geometry, texture) = (Geometry::new(SPEC).unwrap(), TextureNumber::new(0).unwrap());
    let contents = black_but(|_| false)(&geometry).map(Arc::new);
    pager.add_texture(pool, &geometry, None, contents).unwrap();
    (pager, geometry, texture)
}

/// The page whose load was asked for has left the view, but others of its content have not.
#[test]
fn a_load_goes_on_for_the_others_when_its_page_leaves_the_view() {
    let (mut pager, geometry, texture) = black_pager(10);
    let page = |x| PageId::new(texture, geometry.dims(), PagePos::new_2d(2, x, 0)).unwrap();
    let mut frame = 0;
    let mut look = |pager: &mut Pager, x: u32| {
        frame += 1;
        pager.begin_frame(frame);
        pager.view_cut(ViewId::MAIN, frame);
        let pages = vec![WantedPage { page: page(x), pixels: 100, eighth: 0 }];
        pager.observe(&Feedback { frame, pages, ..Feedback::default() });
    };
    look(&mut pager, 0);
    let request = pager.poll_request().unwrap();
    assert!(pager.poll_request().is_none(), "one load for all");
    look(&mut pager, 60);
    assert_eq!((pager.poll_cancel(), pager.poll_request()), (None, None));
    assert_eq!(pager.state(page(60)), PageState::Loading, "as the page that represents its content");
    pager.tile_ready(request.page, Bytes::from_static(b"b"));
    let (_, upload) = pager.poll_upload().unwrap();
    assert!(pager.poll_upload().is_none());
    let mut changes = Vec::new();
    pager.take_table_changes(&mut changes);
    assert_eq!(pager.state(page(60)), PageState::Resident(upload.slot));
    assert!(changes.iter().any(|change| change.page == page(60)));
    assert!(changes.iter().all(|change| change.entry.slot() == upload.slot));
}

/// Slots have as many pages as were put in and not taken out, over a long flight in pools that are far too
/// small.
#[test]
fn no_count_leaks_on_long_flights() {
    let mut random = Random::new(3);
    for path in Path::ALL {
        let slots = 3 + random.below(60) as u32;
        let (seed, share) = (random.bits(), 0.3 + 0.7 * random.below(8) as f64 / 8.0);
        let contents = |geometry: &Geometry| Some(contents_of_chance(geometry, seed, share));
        let (mut crowd, texture) = one_image(slots, path, contents);
        for _ in 0..300 {
            crowd.step().unwrap();
            if random.chance(0.05) {
                let x = random.below(16_000) as u32;
                crowd.change(texture, &Region::image(x..x + 300, 0..8192));
            }
        }
        crowd.remove(texture).unwrap();
        let stats = crowd.pager.stats();
        assert_eq!((stats.occupied, stats.resident, stats.tails), (0, 0, 0), "{path:?}");
        assert!(stats.shared > 0, "{path:?}: {stats:?}");
    }
}

/// Pages that cost no slot are not kept for ever.
#[test]
fn pages_out_of_view_that_share_are_not_more_than_slots_for_long() {
    for path in [Path::Fly, Path::Teleport] {
        let (mut crowd, _) = one_image(10, path, black_but(|_| false));
        (0..300).for_each(|_| crowd.step().unwrap());
        let stats = converge(&mut crowd);
        (0..200).for_each(|_| crowd.step().unwrap());
        let rested = crowd.pager.stats();
        assert_eq!((rested.loaded, rested.occupied), (1, 2), "{path:?}: {rested:?}");
        assert!(stats.shared > 150, "{path:?}: {stats:?}");
        // In a picture of 320x180 pixels no more than 60 pages of 64 texels are seen, on some levels.
        assert!(rested.resident - rested.occupied <= 10 + 120, "{path:?}: {rested:?}");
    }
}
