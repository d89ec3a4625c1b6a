//! Ranks stay true: no page in view waits in the loader for one that is not, whatever was asked for first.
//!
//! `World::step` and `Crowd::step` themselves see to it at each lane that is filled. The loader's tests have
//! the same on threads.

use vastex_core::sim::{Knobs, Path, World};
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, Pager, Region, Request,
    TextureNumber, Urgency, ViewId, WantedPage, checks,
};

/// Requests of a rank from here on are for what is not in view.
const NOT_IN_VIEW: u64 = 1 << 32;

fn texture() -> TextureNumber {
    TextureNumber::new(0).unwrap()
}

fn page(level: u8, x: u32, y: u32) -> PageId {
    PageId::new(texture(), Dims::D2, PagePos::new_2d(level, x, y)).unwrap()
}

/// A pool for an image of 32 by 32 pages, and all in flight that one may wish for.
fn pager() -> Pager {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 1000 });
    let pool = pager.add_pool(400, 1, Some(BiasRule::Solved)).unwrap();
    let geometry = Geometry::new(GeometrySpec::image(4096, 4096)).unwrap();
    pager.add_texture(pool, &geometry, None, None).unwrap();
    pager
}

fn seen(frame: u64, pages: &[PageId]) -> Feedback {
    let mut pages: Vec<_> = pages.iter().map(|&page| WantedPage { page, pixels: 64, eighth: 0 }).collect();
    pages.sort_unstable();
    Feedback { frame, pages, ..Feedback::default() }
}

fn requests(pager: &mut Pager) -> Vec<Request> {
    std::iter::from_fn(|| pager.poll_request()).collect()
}

fn reranks(pager: &mut Pager) -> Vec<Request> {
    std::iter::from_fn(|| pager.poll_rerank()).collect()
}

#[test]
fn a_page_that_was_prefetched_and_comes_into_view_is_ranked_anew_once() {
    let mut pager = pager();
    pager.begin_frame(1);
    let four = Region::image(0..256, 0..256).on_levels(0..=0);
    pager.prefetch(texture(), &four, Urgency::default()).unwrap();
    pager.begin_frame(2);
    let asked_for = requests(&mut pager);
    assert!(asked_for.len() > 4 && asked_for.iter().all(|request| request.rank >= NOT_IN_VIEW));
    let before = pager.stats();
    pager.begin_frame(3);
    pager.observe(&seen(3, &[page(0, 0, 0)]));
    let mut again = reranks(&mut pager);
    assert!(again.iter().all(|request| asked_for.iter().any(|asked| asked.page == request.page)));
    again.retain(|request| request.rank < NOT_IN_VIEW);
    let ancestors = asked_for.iter().filter(|request| request.pos.level > 0).count();
    assert_eq!(again.len(), 1 + ancestors, "the page and what it cannot do without: {again:?}");
    assert!(again.iter().any(|request| request.page == page(0, 0, 0)));
    assert_eq!(requests(&mut pager), [], "it is on its way already");
    let after = pager.stats();
    assert_eq!(
        (after.requests, after.in_flight_bytes),
        (before.requests, before.in_flight_bytes),
        "charged once"
    );
    pager.begin_frame(4);
    pager.observe(&seen(4, &[page(0, 0, 0)]));
    assert_eq!(reranks(&mut pager), [], "told once");
}

#[test]
fn a_page_that_leaves_the_view_and_is_still_held_gives_way() {
    let mut pager = pager();
    pager.begin_frame(1);
    pager.observe(&seen(1, &[page(0, 0, 0)]));
    let asked_for = requests(&mut pager);
    assert!(asked_for.iter().all(|request| request.rank < NOT_IN_VIEW));
    pager.prefetch(texture(), &Region::image(0..128, 0..128), Urgency::default()).unwrap();
    pager.begin_frame(2);
    pager.observe(&seen(2, &[page(0, 20, 20)]));
    assert!(reranks(&mut pager).iter().all(|request| request.rank < NOT_IN_VIEW), "of the last jitter cycle");
    pager.view_cut(ViewId::MAIN, 3);
    pager.begin_frame(3);
    pager.observe(&seen(3, &[page(0, 20, 20)]));
    assert_eq!(pager.poll_cancel(), None);
    let again = reranks(&mut pager);
    let held = again.iter().find(|request| request.page == page(0, 0, 0)).unwrap();
    assert!(held.rank >= NOT_IN_VIEW, "{held:?}");
}

#[test]
fn a_load_whose_place_gets_better_by_far_is_ranked_anew() {
    let mut pager = pager();
    pager.begin_frame(1);
    let side = (0..8).flat_map(|y| (0..8).map(move |x| page(0, x, y)));
    let all: Vec<_> = side.collect();
    pager.observe(&seen(1, &all));
    let asked_for = requests(&mut pager);
    let last = *asked_for.last().unwrap();
    assert!(last.rank > 64);
    // What was far from the middle of the picture is all of it.
    pager.begin_frame(2);
    let mut closer = seen(2, &[last.page]);
    closer.pages[0].pixels = 100_000;
    pager.observe(&closer);
    let again = reranks(&mut pager);
    let moved = again.iter().find(|request| request.page == last.page).unwrap();
    assert!(moved.rank < last.rank / 2, "{moved:?}");
}

#[test]
fn a_load_that_was_called_off_or_has_ended_is_not_asked_for_again() {
    let mut pager = pager();
    pager.begin_frame(1);
    pager.observe(&seen(1, &[page(0, 0, 0), page(0, 31, 31)]));
    let asked_for = requests(&mut pager);
    let [here, gone] = [page(0, 0, 0), page(0, 31, 31)];
    assert!(asked_for.iter().any(|request| request.page == gone));
    pager.view_cut(ViewId::MAIN, 2);
    pager.begin_frame(2);
    pager.observe(&seen(2, &[page(0, 10, 10)]));
    assert!(std::iter::from_fn(|| pager.poll_cancel()).any(|page| page == gone));
    // Both are wanted again, while the loader has yet to answer that it let go of them.
    pager.begin_frame(3);
    pager.observe(&seen(3, &[here, gone]));
    pager.tile_ready(here, bytes::Bytes::from_static(b"tile"));
    let again = reranks(&mut pager);
    assert!(again.iter().all(|request| request.page != here && request.page != gone), "{again:?}");
}

/// `lanes` loads at once, each for so many frames; the camera's next poses are predicted, and parts of the
/// image prefetched.
fn busy_world(path: Path, lanes: usize, latency_frames: u64) -> World {
    let mut knobs =
        Knobs { lead_frames: 8, slots: 900, in_flight_tiles: 200, stray: 5, ..Knobs::new(path, 3) };
    (knobs.loads.lanes, knobs.loads.latency_frames) = (lanes, latency_frames);
    let mut world = World::new(knobs).unwrap();
    for frame in 0..160u32 {
        if frame % 25 == 10 {
            let (x, y) = (frame * 997 % 24_000, frame * 389 % 12_000);
            let part = Region::image(x..x + 2000, y..y + 1000).on_levels(0..=2);
            let urgency = Urgency { priority: frame as i32 % 3, deadline: Some(u64::from(frame) + 60) };
            world.pager.prefetch(texture(), &part, urgency).unwrap();
        }
        checks::paused(|| world.step().unwrap());
    }
    world
}

#[test]
fn no_page_in_view_waits_for_one_that_is_not() {
    for path in Path::ALL {
        for (lanes, latency_frames) in [(1, 1), (2, 1), (8, 1), (8, 4), (32, 4)] {
            let world = busy_world(path, lanes, latency_frames);
            let stats = world.pager.stats();
            let is_still = path == Path::Still; // nothing comes into view after the first frames
            assert!(is_still || world.reranked > 20, "{path:?}: {} of {stats:?}", world.reranked);
        }
    }
}
