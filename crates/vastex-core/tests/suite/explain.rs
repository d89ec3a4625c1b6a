//! Why a pixel shows what it shows, told of every page that is wanted, in lives that are known and in worlds
//! that are not.

use bytes::Bytes;
use vastex_core::sim::{Knobs, Path, World};
use vastex_core::{
    BiasRule, Budgets, Dims, Explanation, Feedback, Geometry, GeometrySpec, Need, PageId, PagePos, PageState,
    Pager, PoolId, Step, TextureNumber, Wait, WantedPage,
};

/// Bytes of the one texture's tiles.
const TILE: u64 = 100;

fn pager(in_flight_bytes: u64, upload_bytes_per_frame: u64) -> Pager {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame, in_flight_bytes });
    let pool = pager.add_pool(100, TILE, Some(BiasRule::Solved)).unwrap();
    let geometry = Geometry::new(GeometrySpec::image(4096, 4096)).unwrap();
    pager.add_texture(pool, &geometry, None, None).unwrap();
    pager
}

fn page(level: u8, x: u32, y: u32) -> PageId {
    PageId::new(TextureNumber::new(0).unwrap(), Dims::D2, PagePos::new_2d(level, x, y)).unwrap()
}

fn wanted(page: PageId) -> WantedPage {
    WantedPage { page, pixels: 10, eighth: 0 }
}

fn see(pager: &mut Pager, frame: u64, pages: &[PageId]) {
    pager.begin_frame(frame);
    pager.observe(&Feedback::of_pages(frame, pages.iter().map(|&page| wanted(page)).collect()));
}

fn explained(pager: &Pager, page: PageId) -> Explanation {
    pager.explain(wanted(page)).unwrap()
}

#[test]
fn a_page_is_followed_from_the_first_look_to_its_slot() {
    let mut pager = pager(2 * TILE, TILE / 2);
    let [first, second] = [page(3, 1, 1), page(3, 2, 1)];
    let before = explained(&pager, first);
    assert_eq!((before.wait, before.history.len()), (Some(Wait::Feedback), 0));
    assert!(before.shown.level() > 3);
    see(&mut pager, 5, &[first, second]);
    let asked: Vec<PageId> =
        std::iter::from_fn(|| pager.poll_request()).map(|request| request.page).collect();
    assert_eq!(asked.len(), 2, "as many as may be in flight");
    // What is missing: two pages of level 3, one or two of level 4. Those that were not asked for wait in
    // their order.
    let all = [first, second, page(4, 0, 0), page(4, 1, 0)];
    let left: Vec<PageId> = all.into_iter().filter(|page| !asked.contains(page)).collect();
    let mut places: Vec<_> = left.iter().map(|&page| explained(&pager, page).wait.unwrap()).collect();
    places.sort_by_key(|wait| format!("{wait:?}"));
    let expected: Vec<_> = (0..left.len() as u32).map(|before| Wait::Request { before }).collect();
    assert_eq!(places, expected);
    assert!(explained(&pager, left[0]).to_string().contains("queued"), "{}", explained(&pager, left[0]));
    assert_eq!(explained(&pager, asked[0]).wait, Some(Wait::Loader));
    see(&mut pager, 6, &[first, second]);
    asked.iter().for_each(|&page| pager.tile_ready(page, Bytes::from_static(b"tile")));
    assert_eq!(explained(&pager, asked[0]).wait, Some(Wait::Upload { before: 0 }));
    assert_eq!(explained(&pager, asked[1]).wait, Some(Wait::Upload { before: 1 }));
    assert_eq!(pager.poll_upload().unwrap().1.page, asked[0]);
    let here = explained(&pager, asked[0]);
    assert_eq!((here.wait, here.shown, here.in_slot), (None, asked[0], 1));
    assert_eq!(here.history, [(5, Step::Wanted), (5, Step::Asked), (6, Step::Settled)]);
    let text = here.to_string();
    assert!(text.contains("shown at full sharpness") && text.ends_with("frame 6: in its slot"), "{text}");
}

#[test]
fn failures_and_what_is_out_of_view_are_told() {
    let mut pager = pager(10 * TILE, 100 * TILE);
    let failing = page(4, 1, 1);
    see(&mut pager, 1, &[failing]);
    let asked: Vec<PageId> =
        std::iter::from_fn(|| pager.poll_request()).map(|request| request.page).collect();
    assert!(asked.contains(&failing));
    pager.tile_failed(failing, "gone");
    let explanation = explained(&pager, failing);
    let PageState::Failed { until } = explanation.state else { panic!("{explanation:?}") };
    assert_eq!((explanation.wait, explanation.failures), (Some(Wait::Retry { at: until }), 1));
    assert!(explanation.to_string().contains("1 load failed in a row"), "{explanation}");
    assert_eq!(pager.explain(wanted(page(0, 999, 0))), None, "there is no such page");
}

/// In any world: what is shown is resident and covers what is wanted, a page waits for something until it is
/// resident, and what comes before others in a queue is one, two, three.
#[test]
fn what_is_told_is_true_of_every_page_in_view() {
    for (seed, path) in (0..).zip(Path::ALL) {
        let knobs = Knobs { slots: 60, ..Knobs::new(path, seed) };
        let geometry = Geometry::new(knobs.spec).unwrap();
        let mut world = World::new(knobs).unwrap();
        let mut waited = 0;
        for _ in 0..60 {
            world.step().unwrap();
            let view = world.view();
            let feedback = view.feedback(TextureNumber::new(0).unwrap(), &geometry, [320, 180], 0, true);
            let pager = &world.pager;
            let mut places = Vec::new();
            for &wanted in &feedback.pages {
                let explanation = pager.explain(wanted).unwrap();
                let state = pager.state(explanation.at_bias);
                assert_eq!(explanation.state, state);
                assert_eq!(explanation.wait.is_none(), matches!(state, PageState::Resident(_)));
                assert!(matches!(pager.state(explanation.shown), PageState::Resident(_)));
                let level =
                    Need::new(wanted.page.level(), wanted.eighth).level_at(world.pool().bias_eighths());
                assert!(explanation.at_bias.level() >= level.min(explanation.at_bias.level()));
                assert!(explanation.history.is_sorted());
                if let Some(Wait::Request { before }) = explanation.wait {
                    places.push((before, explanation.at_bias));
                }
                waited += u32::from(explanation.wait.is_some());
            }
            places.sort_unstable();
            places.dedup();
            assert!(places.windows(2).all(|pair| pair[0].0 < pair[1].0), "no two have one place: {places:?}");
        }
        assert!(waited > 0 || path == Path::Still, "{path:?}: nothing ever waited, so nothing was tried");
    }
}

#[test]
fn pages_of_volumes_are_named_with_all_their_coordinates() {
    let mut pager = pager(10 * TILE, 100 * TILE);
    let geometry = Geometry::new(GeometrySpec { page: 16, ..GeometrySpec::volume([200, 200, 200]) }).unwrap();
    let (volume, _) = pager.add_texture(PoolId::new(0), &geometry, None, None).unwrap();
    let pos = PagePos { level: 0, x: 1, y: 2, z: 3 };
    let page = PageId::new(volume, Dims::D3, pos).unwrap();
    see(&mut pager, 1, &[page]);
    let text = explained(&pager, page).to_string();
    assert!(text.contains("wants level 0 (page 1,2,3)"), "{text}");
}
