//! What an application asks for by hand, in the simulated world: prefetches, pins, and content that changes.
//!
//! `pools.rs` plays random crowds in which all of that happens at once.

use std::collections::BTreeMap;

use vastex_core::sim::{Crowd, Path};
use vastex_core::{
    AskError, BiasRule, Budgets, Dims, GeometrySpec, PageId, PagePos, PageState, PoolPager, Progress, Region,
    TextureNumber, Ticket, TicketState, Urgency,
};

const BUDGETS: Budgets = Budgets { upload_bytes_per_frame: 800, in_flight_bytes: 3200 };

/// One image of 128x64 pages at level 0, seen along `path`, in a pool of so many slots.
fn one_image(slots: u32, path: Path) -> (Crowd, TextureNumber) {
    let mut crowd = Crowd::new(BUDGETS, [320, 180], 1);
    let pool = crowd.add_pool(slots, 100, Some(BiasRule::Solved)).unwrap();
    let texture = crowd.add(pool, GeometrySpec::image(16384, 8192), path).unwrap();
    (crowd, texture)
}

fn run(crowd: &mut Crowd, frames: u64) {
    (0..frames).for_each(|_| crowd.step().unwrap());
}

fn converge(crowd: &mut Crowd) -> u64 {
    let is_done = |_: &u64| {
        crowd.step().unwrap();
        crowd.pager.is_converged()
    };
    (1..=400).find(is_done).expect("a view that holds converges")
}

fn page(texture: TextureNumber, level: u8, x: u32, y: u32) -> PageId {
    PageId::new(texture, Dims::D2, PagePos::new_2d(level, x, y)).unwrap()
}

fn is_here(crowd: &Crowd, page: PageId) -> bool {
    matches!(crowd.pager.state(page), PageState::Resident(_))
}

/// Four by four pages of level 0, and their ancestors, far from where `Path::Still` looks.
fn far_away() -> Region {
    Region::image(0..512, 0..512).on_levels(0..=0)
}

fn progress(crowd: &Crowd, ticket: Ticket) -> Progress {
    crowd.pager.progress(ticket).unwrap()
}

#[test]
fn a_prefetch_brings_its_pages_and_their_ancestors_after_the_view() {
    let (mut crowd, texture) = one_image(400, Path::Still);
    let ticket = crowd.ask(texture, &far_away(), Some(Urgency::default())).unwrap();
    let asked_for = progress(&crowd, ticket).pages;
    assert_eq!(asked_for, 16 + 4 + 5, "with the ancestors before the tail");
    let mut missing_in_view = u32::MAX;
    while crowd.pager.progress(ticket).is_some() {
        crowd.step().unwrap();
        let stats = crowd.pager.stats();
        missing_in_view = stats.missing;
        assert!(crowd.frame < 100, "{stats:?}");
    }
    assert_eq!(missing_in_view, 0, "the view came first");
    for (x, y) in (0..4).flat_map(|y| (0..4).map(move |x| (x, y))) {
        assert!(is_here(&crowd, page(texture, 0, x, y)));
    }
    assert_eq!(crowd.pager.stats().wasted, 0);
}

#[test]
fn a_view_is_complete_as_soon_with_a_prefetch_beside_it_as_without() {
    let (mut alone, _) = one_image(400, Path::Still);
    let (mut beside, texture) = one_image(400, Path::Still);
    beside.ask(texture, &Region::image(0..2048, 0..1024), Some(Urgency::default())).unwrap();
    assert!(converge(&mut beside) <= converge(&mut alone) + 2);
}

#[test]
fn what_is_more_urgent_comes_first() {
    let (mut crowd, texture) = one_image(1000, Path::Still);
    converge(&mut crowd);
    let strip = |n: u32| Region::image(0..2048, 1024 * n..1024 * n + 128).on_levels(0..=0);
    let urgency = |priority, deadline| Urgency { priority, deadline };
    let by_turns = [
        urgency(0, None),
        urgency(0, Some(crowd.frame + 1000)),
        urgency(0, Some(crowd.frame + 500)),
        urgency(2, None),
    ];
    let mut tickets = Vec::new();
    for (n, urgency) in (0..).zip(by_turns) {
        tickets.push(crowd.ask(texture, &strip(n), Some(urgency)).unwrap());
    }
    let mut full = Vec::new();
    while full.len() < 4 {
        run(&mut crowd, 1);
        let is_full = |ticket: Ticket| {
            crowd.pager.progress(ticket).is_none_or(|progress| progress.resident == progress.pages)
        };
        let newly = (0..4).filter(|&n| is_full(tickets[n]) && !full.contains(&n)).collect::<Vec<_>>();
        full.extend(newly);
        assert!(crowd.frame < 1000);
    }
    assert_eq!(full, [3, 2, 1, 0]);
}

#[test]
fn a_prefetch_keeps_its_pages_until_its_deadline_and_no_longer() {
    let (mut crowd, texture) = one_image(70, Path::Fly);
    let deadline = Some(120);
    let ticket = crowd.ask(texture, &far_away(), Some(Urgency { priority: 0, deadline })).unwrap();
    run(&mut crowd, 60);
    for frame in 60..120 {
        let Progress { resident, pages, .. } = progress(&crowd, ticket);
        assert_eq!(resident, pages, "frame {frame}: the flight needs slots, but not these");
        run(&mut crowd, 1);
    }
    assert!(crowd.pager.stats().evicted > 0, "there was something to hold them against");
    run(&mut crowd, 1);
    assert_eq!(crowd.pager.progress(ticket), None);
    run(&mut crowd, 400);
    assert!(!is_here(&crowd, page(texture, 0, 0, 0)), "now they are like all others");
}

#[test]
fn a_deadline_that_cannot_be_met_is_said_and_calls_off_the_rest() {
    let (mut crowd, texture) = one_image(1000, Path::Still);
    converge(&mut crowd);
    let deadline = crowd.frame + 8;
    let region = Region::image(0..4096, 0..2048).on_levels(0..=0);
    let ticket =
        crowd.ask(texture, &region, Some(Urgency { priority: 0, deadline: Some(deadline) })).unwrap();
    while crowd.ended.is_empty() {
        run(&mut crowd, 1);
    }
    let (which, Progress { state, pages, resident, .. }) = crowd.ended[0];
    assert_eq!((which, state), (ticket, TicketState::Late));
    assert!(resident > 0 && resident < pages, "{resident} of {pages}");
    assert_eq!(crowd.frame, deadline + 1);
    let loaded = crowd.pager.stats().loaded;
    run(&mut crowd, 40);
    let stats = crowd.pager.stats();
    assert!(stats.loaded - loaded <= 40 && stats.in_flight == 0, "{stats:?}");
}

#[test]
fn the_view_takes_the_slots_that_it_needs_and_gives_them_back() {
    let (mut crowd, texture) = one_image(40, Path::Still);
    let ticket =
        crowd.ask(texture, &far_away(), Some(Urgency { priority: 0, deadline: Some(10_000) })).unwrap();
    run(&mut crowd, 200);
    let Progress { resident, pages, .. } = progress(&crowd, ticket);
    let stats = crowd.pager.stats();
    assert!(stats.wanted_at_bias + pages > 40, "there is not room for both: {stats:?}");
    assert!(stats.missing == 0 && resident < pages && stats.occupied <= 40, "{stats:?}");
    let loaded = stats.loaded;
    run(&mut crowd, 200);
    assert_eq!(crowd.pager.stats().loaded, loaded, "nothing is loaded over and over");
    crowd.release(ticket).unwrap();
}

#[test]
fn tickets_for_the_same_pages_do_not_get_in_each_others_way() {
    // Room for the view and for the pages once, but not twice.
    let (mut crowd, texture) = one_image(60, Path::Still);
    crowd.loads.latency_frames = 5;
    let urgency = Some(Urgency { priority: 0, deadline: Some(10_000) });
    let [first, second] = [(); 2].map(|()| crowd.ask(texture, &far_away(), urgency).unwrap());
    run(&mut crowd, 200);
    for ticket in [first, second] {
        let Progress { resident, pages, .. } = progress(&crowd, ticket);
        assert_eq!(resident, pages);
    }
    assert_eq!(crowd.pager.stats().cancelled, 0);
}

#[test]
fn pins_stay_whatever_the_view_wants_and_the_bias_makes_room_for_them() {
    let (mut crowd, texture) = one_image(60, Path::Spin);
    let pin = crowd.ask(texture, &far_away(), None).unwrap();
    run(&mut crowd, 60);
    for _ in 0..200 {
        let Progress { resident, pages, state, .. } = progress(&crowd, pin);
        assert_eq!((resident, state), (pages, TicketState::Done));
        run(&mut crowd, 1);
    }
    assert!(crowd.pager.stats().bias_eighths > 0);
    crowd.release(pin).unwrap();
    run(&mut crowd, 200);
    assert!(!is_here(&crowd, page(texture, 0, 0, 0)));
}

#[test]
fn pins_work_without_any_feedback() {
    let (mut crowd, texture) = one_image(100, Path::Still);
    let pin = crowd.ask(texture, &far_away(), None).unwrap();
    for frame in 1..20 {
        crowd.pager.begin_frame(frame);
        while let Some(request) = crowd.pager.poll_request() {
            crowd.pager.tile_ready(request.page, bytes::Bytes::from_static(b"tile"));
        }
        while crowd.pager.poll_upload().is_some() {}
    }
    assert_eq!(progress(&crowd, pin).state, TicketState::Done);
}

#[test]
fn what_cannot_be_is_refused_and_leaves_nothing() {
    let (mut crowd, texture) = one_image(60, Path::Still);
    let before = crowd.pager.stats();
    let gone = TextureNumber::new(9).unwrap();
    let everything = Region::whole();
    assert_eq!(crowd.ask(gone, &everything, None), Err(AskError::NoTexture(9)));
    let refused = crowd.ask(texture, &everything, Some(Urgency::default()));
    assert!(matches!(refused, Err(AskError::TooManyPages { pages: 10_000.., slots: 59 })), "{refused:?}");
    let half = Region::image(0..1024, 0..512).on_levels(0..=0);
    assert_eq!(crowd.ask(texture, &half, None), Err(AskError::TooManyPins { pages: 47, most: 30 }));
    assert!(crowd.ask(texture, &far_away(), None).is_ok());
    let more = Region::image(8192..8704, 0..512).on_levels(0..=0);
    assert!(matches!(crowd.ask(texture, &more, None), Err(AskError::TooManyPins { .. })));
    assert_eq!(crowd.pager.invalidate(gone, &everything), 0);
    assert_eq!(crowd.pager.stats(), before);
    let nothing = crowd.ask(texture, &Region::image(0..0, 0..5), Some(Urgency::default())).unwrap();
    assert_eq!(progress(&crowd, nothing).state, TicketState::Done);
}

#[test]
fn content_that_changes_is_replaced_in_place_without_a_hole() {
    let (mut crowd, texture) = one_image(400, Path::Still);
    converge(&mut crowd);
    let resident =
        |crowd: &Crowd| crowd.pager.pools().flat_map(PoolPager::resident).collect::<BTreeMap<_, _>>();
    let (before, slots) = (crowd.pager.stats(), resident(&crowd));
    crowd.change(texture, &Region::whole());
    assert!(!crowd.is_up_to_date());
    let frames = (1..200).find(|_| {
        crowd.step().unwrap();
        assert_eq!(resident(&crowd), slots, "every page stays in its slot");
        crowd.is_up_to_date()
    });
    let stats = crowd.pager.stats();
    assert_eq!(stats.refreshed, u64::from(before.occupied), "each once, after {frames:?} frames");
    assert_eq!((stats.loaded, stats.evicted), (before.loaded, before.evicted));
    assert!(crowd.pager.is_converged(), "nothing is newly wanted");
}

#[test]
fn content_may_change_again_while_it_is_being_loaded() {
    let (mut crowd, texture) = one_image(400, Path::Still);
    crowd.loads.latency_frames = 5;
    for _ in 0..60 {
        crowd.change(texture, &Region::image(4096..12288, 2048..6144));
        run(&mut crowd, 2);
    }
    run(&mut crowd, 100);
    let stats = crowd.pager.stats();
    assert!(crowd.is_up_to_date() && stats.missing == 0 && stats.in_flight == 0, "{stats:?}");
    assert!(stats.wasted > 0, "some came out of date");
}

#[test]
fn a_refresh_that_fails_leaves_the_old_tile_and_is_tried_again() {
    let (mut crowd, texture) = one_image(400, Path::Still);
    converge(&mut crowd);
    crowd.loads.failing = 1.0;
    crowd.change(texture, &Region::whole());
    run(&mut crowd, 40);
    let stats = crowd.pager.stats();
    assert!(stats.failures > 0 && stats.occupied > 20 && stats.missing == 0, "{stats:?}");
    let requests = stats.requests;
    run(&mut crowd, 20);
    assert!(crowd.pager.stats().requests < requests + u64::from(stats.occupied), "with back-off");
    crowd.loads.failing = 0.0;
    run(&mut crowd, 200);
    assert!(crowd.is_up_to_date());
}

#[test]
fn after_a_lost_device_everything_that_was_here_comes_again() {
    let (mut crowd, texture) = one_image(400, Path::Still);
    let pin = crowd.ask(texture, &far_away(), None).unwrap();
    converge(&mut crowd);
    let before = crowd.pager.stats();
    crowd.change(texture, &Region::whole());
    run(&mut crowd, 2);
    crowd.lose_device();
    let lost = crowd.pager.stats();
    assert_eq!((lost.occupied, lost.tails), (1, 1), "the tail alone is the caller's to put back");
    run(&mut crowd, 60);
    let after = crowd.pager.stats();
    assert_eq!((after.occupied, after.missing, after.bias_eighths), (before.occupied, 0, 0), "{after:?}");
    assert_eq!(after.evicted, 0, "nothing gave way");
    assert_eq!(progress(&crowd, pin).state, TicketState::Done);
    assert!(crowd.is_up_to_date());
}
