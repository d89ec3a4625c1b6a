//! Several views of one crowd: what each wants is kept, whatever becomes of the others.

use std::collections::BTreeSet;

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::sim::{Crowd, Path, Watch};
use vastex_core::{
    BiasRule, Budgets, Event, Feedback, GeometrySpec, MAX_VIEWS, PageId, PageState, Pager, ViewError, ViewId,
    WantedPage,
};

const CYCLE: u64 = JITTER_CYCLE as u64;
/// In every frame, and far ahead of the main view.
const AWAY: Watch = Watch { ahead: 250, every: 1 };
const PAUSED: Watch = Watch { every: 0, ..AWAY };

/// Two textures, each along `path`, in a pool of so many slots.
fn crowd(path: Path, slots: u32) -> Crowd {
    let budgets = Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 6400 };
    let mut crowd = Crowd::new(budgets, [320, 180], 1);
    let pool = crowd.add_pool(slots, 100, Some(BiasRule::Solved)).unwrap();
    for _ in 0..2 {
        crowd.add(pool, GeometrySpec::image(32768, 16384), path).unwrap();
    }
    crowd
}

fn play(crowd: &mut Crowd, frames: u64) {
    (0..frames).for_each(|_| crowd.step().unwrap());
}

fn resident(crowd: &Crowd) -> BTreeSet<PageId> {
    crowd.pager.pools().flat_map(|pager| pager.resident().map(|(page, _)| page)).collect()
}

fn frames_until_converged(crowd: &mut Crowd) -> u64 {
    (1..1000)
        .find(|_| {
            crowd.step().unwrap();
            crowd.pager.is_converged()
        })
        .unwrap()
}

#[test]
fn a_second_view_like_the_first_changes_nothing_of_what_is_resident() {
    for path in Path::ALL {
        for slots in [1000, 60] {
            let [mut one, mut two] = [crowd(path, slots), crowd(path, slots)];
            two.add_view(1.0, Watch { ahead: 0, every: 1 }).unwrap();
            for _ in 0..120 {
                one.step().unwrap();
                two.step().unwrap();
                assert_eq!(resident(&one), resident(&two), "{path:?}, {slots} slots, frame {}", one.frame);
            }
            let [one, two] = [one.pager.stats(), two.pager.stats()];
            assert_eq!((one.loaded, one.share_at_wanted()), (two.loaded, two.share_at_wanted()));
        }
    }
}

#[test]
fn a_view_that_pauses_keeps_what_it_wanted_and_one_that_is_removed_does_not() {
    let mut crowd = crowd(Path::Fly, 140);
    let mirror = crowd.add_view(1.0, AWAY).unwrap();
    play(&mut crowd, 60);
    crowd.change_view(mirror, PAUSED, false);
    // The main view goes on, over more than the pool holds. That what the mirror saw last stays the crowd
    // checks.
    play(&mut crowd, 500);
    crowd.hold();
    play(&mut crowd, 2 * CYCLE);
    let before = crowd.pager.stats();
    assert_eq!((before.missing, before.bias_eighths), (0, 0), "{before:?}");
    assert!(before.evicted > 150, "{before:?}");
    assert!(crowd.pager.is_converged());
    crowd.remove_view(mirror);
    let [after, alone] = [crowd.pager.stats(), {
        let mut alone = self::crowd(Path::Fly, 140);
        play(&mut alone, 560);
        alone.hold();
        play(&mut alone, 2 * CYCLE);
        alone.pager.stats()
    }];
    assert!(before.wanted > after.wanted + 30, "{} pages, then {}", before.wanted, after.wanted);
    assert_eq!((after.wanted, after.pixels, after.missing), (alone.wanted, alone.pixels, 0));
}

#[test]
fn a_cut_of_one_view_leaves_the_others() {
    let mut crowd = crowd(Path::Still, 1000);
    let other = crowd.add_view(1.0, PAUSED).unwrap();
    play(&mut crowd, 40);
    let main = crowd.pager.stats();
    // It looks at the same, from now on; then it jumps away, declared and not, and main's window is whole all
    // the time.
    for declared in [true, false] {
        crowd.change_view(other, Watch { ahead: 0, every: 1 }, true);
        play(&mut crowd, 40);
        assert_eq!(crowd.pager.stats().wanted, main.wanted);
        crowd.change_view(other, PAUSED, declared);
        let before = crowd.pager.stats().pixels;
        play(&mut crowd, 10);
        let stats = crowd.pager.stats();
        assert_eq!((stats.wanted, stats.loaded, stats.pixels), (main.wanted, main.loaded, before));
    }
    crowd.pager.view_cut(ViewId::MAIN, crowd.frame + 1);
    play(&mut crowd, 3);
    let stats = crowd.pager.stats();
    // One feedback of the main view, and a cycle of the other.
    let one = stats.pixels - main.pixels;
    assert!((main.pixels / 20..main.pixels / 12).contains(&one), "{one} pixels of {}", main.pixels);
    assert_eq!((stats.wanted, stats.evicted), (main.wanted, main.evicted));
}

#[test]
fn a_weight_decides_what_comes_first_and_nothing_else() {
    let play = |weight: f32| {
        let mut crowd = crowd(Path::Still, 1000);
        let texture = crowd.textures().nth(1).unwrap();
        // The view beside looks at the second texture alone: at the first frame, by hand.
        let view = crowd.pager.add_view(weight).unwrap();
        crowd.pager.begin_frame(crowd.frame);
        let wanted: Vec<WantedPage> = (0..40)
            .map(|x| {
                let pos = vastex_core::PagePos::new_2d(0, 100 + x, 60);
                let page = PageId::new(texture, vastex_core::Dims::D2, pos).unwrap();
                WantedPage { page, pixels: 7, eighth: 0 }
            })
            .collect();
        crowd.pager.observe(&Feedback { view, pages: wanted.clone(), ..Feedback::default() });
        let is_here = |crowd: &Crowd, page: PageId| matches!(crowd.pager.state(page), PageState::Resident(_));
        let mut came_after = 0;
        for _ in 0..60 {
            crowd.step().unwrap();
            came_after += wanted.iter().filter(|wanted| !is_here(&crowd, wanted.page)).count();
        }
        let stats = crowd.pager.stats();
        assert_eq!((stats.missing, stats.bias_eighths), (0, 0), "{stats:?}");
        (came_after, resident(&crowd))
    };
    let [(light, of_light), (equal, of_equal), (heavy, of_heavy)] = [0.0, 1.0, 100.0].map(play);
    assert!(heavy < equal && equal <= light, "frames of waiting: {heavy}, {equal}, {light}");
    assert!(of_light == of_equal && of_equal == of_heavy);
}

#[test]
fn what_all_views_want_must_fit() {
    let mut alone = crowd(Path::Still, 110);
    play(&mut alone, 60);
    assert_eq!(alone.pager.stats().bias_eighths, 0);
    let mut both = crowd(Path::Still, 110);
    // The same place, seen more sharply.
    let view = both.add_view(1.0, PAUSED).unwrap();
    play(&mut both, 60);
    let sharp: Vec<WantedPage> = (0..80)
        .map(|n| {
            let pos = vastex_core::PagePos::new_2d(0, 90 + n % 10, 40 + n / 10);
            let page = PageId::new(both.textures().next().unwrap(), vastex_core::Dims::D2, pos).unwrap();
            WantedPage { page, pixels: 1, eighth: 0 }
        })
        .collect();
    both.pager.observe(&Feedback { view, frame: both.frame, pages: sharp, ..Feedback::default() });
    let stats = both.pager.stats();
    assert!(stats.bias_eighths > 0 && stats.wanted_at_bias <= 99, "{stats:?}");
    assert!(both.pager.remove_view(view));
    play(&mut both, 2 * CYCLE + 2);
    assert_eq!(both.pager.stats().bias_eighths, 0, "what is gone needs no room");
}

#[test]
fn converged_means_a_whole_cycle_of_each_view_that_is_drawn() {
    let mut crowd = crowd(Path::Still, 1000);
    crowd.add_view(1.0, PAUSED).unwrap();
    let alone = frames_until_converged(&mut crowd);
    assert!(alone < 60, "a view that is never drawn says nothing: {alone} frames");
    // One that is drawn in every fourth frame needs four times as long, and one that looks no more holds up
    // nothing.
    let rare = crowd.add_view(1.0, Watch { ahead: 0, every: 4 }).unwrap();
    play(&mut crowd, 7);
    assert!(!crowd.pager.is_converged(), "there is a view that has not yet shown all");
    let slowly = 7 + frames_until_converged(&mut crowd);
    assert!((4 * (CYCLE - 1)..5 * CYCLE).contains(&slowly), "{slowly} frames");
    crowd.pager.view_cut(rare, crowd.frame + 1);
    play(&mut crowd, 8);
    assert!(!crowd.pager.is_converged());
    crowd.change_view(rare, PAUSED, false);
    let paused = frames_until_converged(&mut crowd);
    assert!(paused <= CYCLE + 3, "{paused} frames");
    let said = crowd.events.iter().filter(|(_, event)| matches!(event, Event::Converged { .. })).count();
    assert_eq!(said, 3);
}

#[test]
fn views_run_out_and_numbers_are_not_given_twice() {
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1, in_flight_bytes: 1 });
    let views: Vec<ViewId> = (1..MAX_VIEWS).map(|_| pager.add_view(1.0).unwrap()).collect();
    assert_eq!(pager.add_view(1.0), Err(ViewError::TooMany));
    assert!(!pager.remove_view(ViewId::MAIN) && pager.set_weight(ViewId::MAIN, 2.0));
    assert!(pager.remove_view(views[2]) && !pager.remove_view(views[2]) && !pager.set_weight(views[2], 1.0));
    let next = pager.add_view(1.0).unwrap();
    assert!(!views.contains(&next) && next != ViewId::MAIN);
    // A pool that comes later knows them all.
    pager.add_pool(10, 1, None).unwrap();
    assert_eq!(pager.add_view(1.0), Err(ViewError::TooMany));
    assert!(views.iter().filter(|&&view| pager.remove_view(view)).count() == MAX_VIEWS - 2);
}
