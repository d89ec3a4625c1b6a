//! Textures that share the in-flight budget: one whose loads never end keeps no other from becoming sharp.

use std::collections::BTreeSet;

use vastex_core::sim::{Crowd, Path};
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, Pager, PoolId, Region,
    TextureNumber, Urgency, WantedPage,
};

const TILE_BYTES: u64 = 100;
/// What the textures want together is several times as much.
const TILES_IN_FLIGHT: u64 = 16;
const BUDGETS: Budgets =
    Budgets { upload_bytes_per_frame: 8 * TILE_BYTES, in_flight_bytes: TILES_IN_FLIGHT * TILE_BYTES };

fn image() -> GeometrySpec {
    GeometrySpec { page: 64, ..GeometrySpec::image(16384, 8192) }
}

/// Still views of so many textures, each in the pool of that number, which are large enough.
fn crowd(pools: &[usize]) -> (Crowd, Vec<TextureNumber>) {
    let mut crowd = Crowd::new(BUDGETS, [320, 180], 1);
    let count = pools.iter().max().map_or(0, |most| most + 1);
    let ids: Vec<PoolId> =
        (0..count).map(|_| crowd.add_pool(2000, TILE_BYTES, Some(BiasRule::Solved)).unwrap()).collect();
    let textures = pools.iter().map(|&pool| crowd.add(ids[pool], image(), Path::Still).unwrap()).collect();
    crowd.hold();
    (crowd, textures)
}

/// Plays until all has converged.
fn converge(crowd: &mut Crowd) {
    let is_done = (0..400).any(|_| {
        crowd.step().unwrap();
        crowd.pager.is_converged()
    });
    assert!(is_done, "{:?}", crowd.pager.stats());
}

fn resident(crowd: &Crowd, texture: TextureNumber) -> BTreeSet<PageId> {
    let all = crowd.pager.pools().flat_map(|pager| pager.resident());
    all.map(|(page, _)| page).filter(|page| page.texture() == texture).collect()
}

/// The pages of each texture where all loads end.
fn sharp(pools: &[usize]) -> Vec<BTreeSet<PageId>> {
    let (mut crowd, textures) = crowd(pools);
    converge(&mut crowd);
    let sharp: Vec<_> = textures.iter().map(|&texture| resident(&crowd, texture)).collect();
    assert!(sharp.iter().all(|pages| pages.len() as u64 > 2 * TILES_IN_FLIGHT), "too few to fill the budget");
    sharp
}

/// Frames until the texture has all these pages; fails where that takes longer than `limit`.
fn frames_until(crowd: &mut Crowd, texture: TextureNumber, pages: &BTreeSet<PageId>, limit: u64) -> u64 {
    let found = (1..=limit).find(|_| {
        crowd.step().unwrap();
        resident(crowd, texture).is_superset(pages)
    });
    found.unwrap_or_else(|| panic!("not sharp after {limit} frames: {:?}", crowd.pager.stats()))
}

#[test]
fn a_texture_whose_loads_never_end_leaves_half_of_the_budget_to_others() {
    for pools in [[0, 0], [0, 1], [1, 0]] {
        let expected = sharp(&pools);
        let (mut crowd, textures) = crowd(&pools);
        crowd.loads.silent = vec![textures[0]];
        // The dead one is there first, and so are its requests.
        frames_until(&mut crowd, textures[1], &expected[1], 200);
        (0..20).for_each(|_| crowd.step().unwrap());
        let stats = crowd.pager.stats();
        assert_eq!(stats.in_flight_bytes, BUDGETS.in_flight_bytes / 2, "{pools:?}: what the dead one holds");
        assert_eq!(resident(&crowd, textures[0]).len(), 1, "its tail");
    }
}

#[test]
fn a_texture_that_comes_later_finds_room() {
    let pools = [0, 0, 0];
    let expected = sharp(&pools);
    let (mut crowd, textures) = crowd(&pools[..2]);
    crowd.loads.silent = vec![textures[0]];
    (0..100).for_each(|_| crowd.step().unwrap());
    let late = crowd.add(PoolId::default(), image(), Path::Still).unwrap();
    // The cameras are where they were, so it wants what it would have wanted.
    frames_until(&mut crowd, late, &expected[2], 200);
}

#[test]
fn several_dead_textures_leave_room_too() {
    let pools = [0, 1, 0, 1];
    let expected = sharp(&pools);
    let (mut crowd, textures) = crowd(&pools);
    crowd.loads.silent = textures[..3].to_vec();
    frames_until(&mut crowd, textures[3], &expected[3], 400);
    (0..20).for_each(|_| crowd.step().unwrap());
    let held = crowd.pager.stats().in_flight_bytes;
    assert!(held + TILE_BYTES <= BUDGETS.in_flight_bytes, "{held} bytes are held");
}

#[test]
fn one_texture_may_hold_the_whole_budget() {
    let (mut crowd, textures) = crowd(&[0]);
    crowd.loads.silent = textures;
    (0..30).for_each(|_| crowd.step().unwrap());
    assert_eq!(crowd.pager.stats().in_flight_bytes, BUDGETS.in_flight_bytes);
}

/// Feedback seldom comes in each frame; what was passed over needs none.
#[test]
fn what_was_passed_over_is_asked_for_when_there_is_room_again() {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 400 });
    let pool = pager.add_pool(200, TILE_BYTES, None).unwrap();
    let geometry = Geometry::new(image()).unwrap();
    let [texture, _] = [(); 2].map(|()| pager.add_texture(pool, &geometry, None, None).unwrap().0);
    let page = |x| PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, 0)).unwrap();
    let pages = (0..8).map(|x| WantedPage { page: page(x), pixels: 64, eighth: 0 }).collect();
    pager.begin_frame(1);
    pager.observe(&Feedback { frame: 1, pages, ..Feedback::default() });
    let first: Vec<_> = std::iter::from_fn(|| pager.poll_request()).collect();
    assert_eq!(first.len(), 2, "half of the budget");
    for request in &first {
        pager.tile_ready(request.page, vec![0; TILE_BYTES as usize].into());
    }
    pager.begin_frame(2);
    assert!(pager.poll_request().is_none(), "they wait for their slots");
    assert_eq!(std::iter::from_fn(|| pager.poll_upload()).count(), 2);
    pager.begin_frame(3);
    let next: Vec<_> = std::iter::from_fn(|| pager.poll_request()).collect();
    assert!(next.len() == 2 && !first.iter().any(|request| next.contains(request)), "{next:?}");
}

#[test]
fn textures_that_are_all_tail_share_nothing() {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 400 });
    let pool = pager.add_pool(200, TILE_BYTES, None).unwrap();
    let small = Geometry::new(GeometrySpec { page: 64, ..GeometrySpec::image(8, 8) }).unwrap();
    assert_eq!(small.page_count(), 1);
    for _ in 0..3 {
        pager.add_texture(pool, &small, None, None).unwrap();
    }
    let (texture, _) = pager.add_texture(pool, &Geometry::new(image()).unwrap(), None, None).unwrap();
    let page = |x| PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, 0)).unwrap();
    let pages = (0..8).map(|x| WantedPage { page: page(x), pixels: 64, eighth: 0 }).collect();
    pager.begin_frame(1);
    pager.observe(&Feedback { frame: 1, pages, ..Feedback::default() });
    assert_eq!(std::iter::from_fn(|| pager.poll_request()).count(), 4);
}

/// What a texture has in flight by hand is not what it holds in view.
#[test]
fn a_page_in_view_does_not_wait_for_prefetches_of_its_own_texture() {
    let mut pager = Pager::new(BUDGETS);
    let pool = pager.add_pool(200, TILE_BYTES, None).unwrap();
    let geometry = Geometry::new(image()).unwrap();
    let [texture, _] = [(); 2].map(|()| pager.add_texture(pool, &geometry, None, None).unwrap().0);
    let far_away = Region::image(0..512, 0..512).on_levels(0..=0);
    pager.prefetch(texture, &far_away, Urgency::default()).unwrap();
    pager.begin_frame(1);
    let by_hand = std::iter::from_fn(|| pager.poll_request()).count() as u64;
    assert_eq!(by_hand, TILES_IN_FLIGHT / 2);
    let page = |x| PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, 100)).unwrap();
    let pages = (200..208).map(|x| WantedPage { page: page(x), pixels: 64, eighth: 0 }).collect();
    pager.begin_frame(2);
    pager.observe(&Feedback { frame: 2, pages, ..Feedback::default() });
    let in_view = std::iter::from_fn(|| pager.poll_request()).count() as u64;
    assert_eq!(in_view, TILES_IN_FLIGHT / 4, "half of what the prefetch leaves");
}

#[test]
fn a_texture_that_does_not_answer_does_not_say_that_bandwidth_is_short() {
    let (mut crowd, textures) = crowd(&[0, 1]);
    let is_short = (0..12).any(|_| {
        crowd.step().unwrap();
        crowd.pager.is_short_of_bandwidth()
    });
    assert!(is_short, "both are answered and want more than there is");
    let (mut crowd, expected) = (crowd_with_silent(&[0, 1]), sharp(&[0, 1]));
    frames_until(&mut crowd, textures[1], &expected[1], 200);
    (0..100).for_each(|_| crowd.step().unwrap());
    let stats = crowd.pager.stats();
    assert_eq!(stats.in_flight_bytes, BUDGETS.in_flight_bytes / 2, "the first one is held back");
    assert!(!crowd.pager.is_short_of_bandwidth(), "nobody else wants anything: {stats:?}");
}

/// As [`crowd`], with a first texture that is never answered.
fn crowd_with_silent(pools: &[usize]) -> Crowd {
    let (mut crowd, textures) = crowd(pools);
    crowd.loads.silent = vec![textures[0]];
    crowd
}

/// Pools of tiles of so many bytes, each with a still view of a texture; the textures.
fn pools_of(tile_bytes: &[u64], budgets: Budgets) -> (Crowd, Vec<TextureNumber>) {
    let mut crowd = Crowd::new(budgets, [320, 180], 1);
    let textures = tile_bytes.iter().map(|&tile_bytes| {
        let pool = crowd.add_pool(2000, tile_bytes, Some(BiasRule::Solved)).unwrap();
        crowd.add(pool, image(), Path::Still).unwrap()
    });
    let textures = textures.collect();
    crowd.hold();
    (crowd, textures)
}

/// A tile of nearly the whole budget holds back the small ones, and these catch up.
#[test]
fn large_tiles_and_small_ones_get_the_same_bytes() {
    let largest = 1400;
    let budgets = Budgets { upload_bytes_per_frame: 300, in_flight_bytes: 1600 };
    let (mut crowd, _) = pools_of(&[200, largest, 100], budgets);
    (0..32).for_each(|_| crowd.step().unwrap());
    let uploaded: Vec<u64> = crowd.pager.pools().map(|pager| pager.stats().uploaded_bytes).collect();
    let (least, most) = (uploaded.iter().min().unwrap(), uploaded.iter().max().unwrap());
    assert!(*least >= largest && most - least <= largest * 3 / 2, "{uploaded:?}");
}

/// What a dead texture holds is not to be had, so nobody waits behind a tile that needs it.
#[test]
fn a_tile_too_large_for_what_a_dead_texture_leaves_does_not_stop_smaller_ones() {
    let large = BUDGETS.in_flight_bytes / 2 + TILE_BYTES;
    let expected = sharp(&[0, 1, 2]);
    let (mut crowd, textures) = pools_of(&[TILE_BYTES, TILE_BYTES, large], BUDGETS);
    crowd.loads.silent = vec![textures[0]];
    frames_until(&mut crowd, textures[1], &expected[1], 300);
    let stats = crowd.pager.stats();
    assert!(
        stats.in_flight_bytes + large > BUDGETS.in_flight_bytes,
        "the large tile finds no room: {stats:?}"
    );
}
