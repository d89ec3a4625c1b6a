//! Gaps of views that rest: what few pixels need is found once the cycle has nothing missing, is held as long
//! as the view rests, and is there before the view has converged.

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, PageState, Pager, Region,
    TextureNumber, Urgency, ViewId, WantedPage,
};

const CYCLE: u64 = JITTER_CYCLE as u64;
/// Feedbacks that look at all pixels.
const PASSES: u32 = 8;

/// Pages of a row of a texture. Each pool has one.
const ROW: u32 = 32;

/// The pages of the pools' rows, one row after the other.
fn page(x: u32) -> PageId {
    let texture = TextureNumber::new((x / ROW) as u16).unwrap();
    PageId::new(texture, Dims::D2, PagePos::new_2d(0, x % ROW, 0)).unwrap()
}

/// A pager whose view sees one page in its cycle, and others in gaps.
struct World {
    pager: Pager,
    frame: u64,
    /// Pages that can never be had.
    failing: Vec<PageId>,
    loaded: u32,
    /// Passes in which gaps were looked for.
    passes: u32,
    /// True if all pages of gaps lie behind each other on one ray.
    is_one_ray: bool,
    /// How many of the pages that it lacks that ray passes over when gaps are first looked for.
    over: u32,
    /// What other rays name in the cycle, and in gaps as long as it is not there.
    seen_too: Vec<u32>,
    /// How far into their level pages of gaps are needed.
    eighth: u8,
}

impl World {
    fn new(slots: u32) -> World {
        World::of_pools(1, slots)
    }

    fn of_pools(pools: u32, slots: u32) -> World {
        let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 1000 });
        let geometry = Geometry::new(GeometrySpec::image(4096, 4096)).unwrap();
        for _ in 0..pools {
            let pool = pager.add_pool(slots, 1, Some(BiasRule::Solved)).unwrap();
            pager.add_texture(pool, &geometry, None, None).unwrap();
        }
        let (failing, seen_too) = (Vec::new(), Vec::new());
        World {
            pager,
            frame: 0,
            failing,
            loaded: 0,
            passes: 0,
            is_one_ray: false,
            over: 0,
            seen_too,
            eighth: 0,
        }
    }

    /// Pages that can never be had, on one ray of which all pages of gaps are, and on others.
    fn of_failing(pools: u32, failing: &[u32]) -> World {
        let mut world = World::of_pools(pools, 100);
        world.is_one_ray = true;
        world.failing.extend(failing.iter().map(|x| page(*x)));
        world.seen_too.extend(failing);
        world.pager.set_gap_passes(ViewId::MAIN, PASSES);
        world
    }

    /// A frame: what pixels of the cycle want, or, where gaps are looked for, those of `gaps` that are not
    /// there. Returns true if gaps were looked for.
    fn frame(&mut self, cycle: u32, gaps: &[u32]) -> bool {
        let seeks = self.pager.looks_for_gaps(ViewId::MAIN);
        self.frame += 1;
        self.pager.begin_frame(self.frame);
        let is_there = |page: &PageId| matches!(self.pager.state(*page), PageState::Resident(_));
        let mut pages: Vec<PageId> = match seeks {
            true => gaps.iter().map(|x| page(*x)).filter(|page| !is_there(page)).collect(),
            false => self.seen_too.iter().chain([&cycle]).map(|x| page(*x)).collect(),
        };
        if seeks && self.is_one_ray && !pages.is_empty() {
            // As shaders do: the first ones are passed over, more of them whenever all pixels were looked at.
            let over = (self.passes / PASSES + self.over) % self.pager.gaps_by_turns(ViewId::MAIN);
            pages = vec![pages[(over as usize).min(pages.len() - 1)]];
        }
        if seeks {
            let lacking = self.seen_too.iter().map(|x| page(*x)).filter(|page| !is_there(page));
            let others: Vec<PageId> = lacking.filter(|page| !pages.contains(page)).collect();
            pages.extend(others);
        }
        self.passes += u32::from(seeks);
        let eighth = if seeks { self.eighth } else { 0 };
        let pages = pages.into_iter().map(|page| WantedPage { page, pixels: 1, eighth }).collect();
        self.pager.observe(&Feedback { gaps: seeks, ..Feedback::of_pages(self.frame, pages) });
        self.load();
        seeks
    }

    /// A frame in which no view is drawn.
    fn undrawn_frame(&mut self) {
        self.frame += 1;
        self.pager.begin_frame(self.frame);
        self.load();
    }

    fn load(&mut self) {
        while let Some(request) = self.pager.poll_request() {
            match self.failing.contains(&request.page) {
                true => self.pager.tile_failed(request.page, "gone"),
                false => {
                    self.loaded += 1;
                    self.pager.tile_ready(request.page, vec![0].into());
                }
            }
        }
        while self.pager.poll_upload().is_some() {}
    }

    fn frames_until_converged(&mut self, cycle: u32, gaps: &[u32]) -> u64 {
        let found = (1..60 * CYCLE).find(|_| {
            self.frame(cycle, gaps);
            self.pager.is_converged() && self.pager.is_view_converged(ViewId::MAIN)
        });
        found.unwrap_or_else(|| panic!("never: {:?}", self.pager.stats()))
    }

    fn is_there(&self, x: u32) -> bool {
        matches!(self.pager.state(page(x)), PageState::Resident(_))
    }
}

#[test]
fn a_view_that_rests_has_what_few_pixels_need_before_it_has_converged() {
    let mut world = World::new(100);
    let moving = world.frames_until_converged(0, &[20, 31]);
    assert!(!world.is_there(20), "one that does not rest knows of its cycle alone");
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    assert!(!world.pager.is_view_converged(ViewId::MAIN));
    // Pages of the cycle are not near them: that is no jump.
    let resting = world.frames_until_converged(0, &[20, 31]);
    assert!(world.is_there(20) && world.is_there(31));
    let least = CYCLE + u64::from(PASSES);
    assert!((least..least + moving).contains(&resting), "{resting} after {moving} frames");
    let (wanted, loaded) = (world.pager.stats().wanted, world.loaded);
    for _ in 0..10 * CYCLE {
        assert!(world.frame(0, &[20, 31]), "it goes on looking");
        assert!(world.pager.is_converged());
    }
    assert_eq!((world.pager.stats().wanted, world.loaded), (wanted, loaded), "they are held");
    // Something comes to be seen.
    let more = world.frames_until_converged(0, &[9, 20, 31]);
    assert!(world.is_there(9) && more >= u64::from(PASSES), "{more}");
    world.pager.set_gap_passes(ViewId::MAIN, 0);
    world.frame(0, &[]);
    assert!(world.pager.stats().wanted < wanted, "they are let go of: {:?}", world.pager.stats());
}

#[test]
fn what_cannot_be_had_is_not_waited_for() {
    let mut world = World::new(100);
    world.failing.push(page(20));
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    world.frames_until_converged(0, &[20, 31]);
    assert!(world.is_there(31) && !world.is_there(20));
}

/// However many bricks on a ray cannot be had, those behind them and between them are found.
#[test]
fn what_cannot_be_had_hides_nothing_behind_it() {
    for failing in [0, 1, 3, 7, 20] {
        let mut world = World::new(100);
        world.is_one_ray = true;
        world.failing.extend((1..=failing).map(page));
        world.pager.set_gap_passes(ViewId::MAIN, PASSES);
        let mut gaps: Vec<u32> = (1..=failing).collect();
        gaps.insert(failing as usize / 2, 30);
        gaps.push(31);
        let frames = world.frames_until_converged(0, &gaps);
        assert!(world.is_there(30) && world.is_there(31), "{failing}");
        let rounds = if failing == 0 { 1 } else { world.pager.gaps_by_turns(ViewId::MAIN) };
        assert!(u64::from(rounds * PASSES) <= frames, "{frames} frames with {failing}");
        assert!((failing..=2 * failing + 4).contains(&rounds) || failing < 3, "{rounds} with {failing}");
    }
}

/// What cannot be had in two pools hides nothing of either, on a ray that comes to what stands between last.
#[test]
fn what_cannot_be_had_in_two_pools_hides_nothing_between() {
    for ((first, second), hidden) in [((10, 10), 30), ((10, 10), ROW + 30), ((3, 12), 30), ((1, 1), ROW + 30)]
    {
        let mut gaps: Vec<u32> = (1..=first).chain(ROW + 1..=ROW + second).collect();
        gaps.sort_by_key(|x| x % ROW);
        let mut world = World::of_failing(2, &gaps);
        let place = first.min(second);
        gaps.insert(place as usize, hidden);
        world.over = place + 1;
        let frames = world.frames_until_converged(0, &gaps);
        assert!(world.is_there(hidden), "{hidden} after {frames} frames with {first} and {second}");
        let rounds = world.pager.gaps_by_turns(ViewId::MAIN);
        assert_eq!(rounds, (2 * (first + second + 1)).max(4));
        assert!(u64::from(rounds * PASSES) <= frames, "{frames} frames with {first} and {second}");
    }
}

/// Where a page comes after all, rays take other turns, and what they passed over before says nothing.
#[test]
fn rounds_of_other_turns_do_not_count() {
    for over in 0..14 {
        let mut world = World::of_failing(1, &[1, 2, 3, 4, 5, 6]);
        world.over = over;
        let gaps = [1, 2, 3, 30, 4, 5, 6];
        for _ in 0..4 * CYCLE {
            world.frame(0, &gaps);
        }
        assert!(!world.pager.is_converged());
        assert_eq!(world.pager.gaps_by_turns(ViewId::MAIN), 14);
        world.failing.remove(0);
        world.frames_until_converged(0, &gaps);
        assert_eq!(world.pager.gaps_by_turns(ViewId::MAIN), 12);
        assert!(world.is_there(1) && world.is_there(30), "{over}");
    }
}

/// A view whose rays meet many bricks looks for gaps after one jitter cycle at rest, and forgets then what it
/// wanted while it moved.
#[test]
fn gaps_are_looked_for_after_one_jitter_cycle_whatever_the_turns() {
    let mut world = World::new(100);
    world.pager.set_view_turns(ViewId::MAIN, 4);
    for frame in 0..4 * CYCLE {
        world.frame(if frame < 4 * CYCLE - 4 { 0 } else { 9 }, &[]);
    }
    assert!(world.is_there(0) && world.is_there(9));
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    let wanted = world.pager.stats().wanted;
    let frames = world.frames_until_converged(9, &[20]);
    let least = CYCLE + u64::from(PASSES);
    assert!((least..least + 8).contains(&frames), "{frames}");
    assert!(world.is_there(20));
    // The page of before is let go of, and the gap has come.
    assert!(world.pager.stats().wanted < wanted + 3, "{:?} after {wanted}", world.pager.stats());
}

#[test]
fn a_jump_begins_anew_and_forgets_gaps() {
    let mut world = World::new(100);
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    world.frames_until_converged(0, &[20]);
    world.pager.view_cut(ViewId::MAIN, world.frame + 1);
    assert!(world.frame(31, &[25]), "the last one before the cut is known");
    for _ in 0..CYCLE - 1 {
        assert!(!world.frame(31, &[25]) && !world.pager.is_converged());
    }
    world.frames_until_converged(31, &[25]);
    assert!(world.is_there(25) && world.is_there(31));
    let wanted = world.pager.stats().wanted;
    world.pager.set_gap_passes(ViewId::MAIN, 0);
    world.frame(31, &[]);
    let after = world.pager.stats().wanted;
    assert!(after < wanted && after > 0, "{wanted}, then {after}");
}

/// Where a pool is too small it becomes coarser by what gaps need, too, and nothing is loaded twice.
#[test]
fn gaps_count_for_the_bias() {
    let mut world = World::new(7);
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    world.frames_until_converged(0, &[8, 12, 16, 20, 24, 28]);
    let stats = world.pager.stats();
    assert!(stats.bias_eighths > 0 && stats.missing == 0 && stats.reloaded == 0, "{stats:?}");
    for _ in 0..10 * CYCLE {
        world.frame(0, &[8, 12, 16, 20, 24, 28]);
    }
    assert_eq!(world.pager.stats().loaded, stats.loaded);
}

/// A gap that is named once more, by a pixel that needs the page more sharply, is needed so: at a mip bias
/// that pixel would go on lacking what it is to show.
#[test]
fn a_gap_is_needed_as_sharply_as_any_pixel_says() {
    let bias_after = |eighths: &[u8]| {
        let mut world = World::new(7);
        world.pager.set_gap_passes(ViewId::MAIN, PASSES);
        for &eighth in eighths {
            world.eighth = eighth;
            world.frames_until_converged(0, &[8, 12, 16, 20, 24, 28]);
        }
        world.pager.stats().bias_eighths
    };
    let [least, most] = [7, 0].map(|eighth| bias_after(&[eighth]));
    assert!(least < most, "{least}, {most}");
    assert_eq!(bias_after(&[7, 0]), most);
    assert_eq!(bias_after(&[0, 7]), most);
}

/// What another view says of a page is not what this one needs: it may move away, and nobody asks this one
/// again.
#[test]
fn a_gap_is_needed_as_sharply_as_its_own_view_says_whatever_others_do() {
    let gaps = [8, 12, 16, 20, 24, 28];
    let mut world = World::new(7);
    let other = world.pager.add_view(1.0).unwrap();
    let pages = gaps.map(|x| WantedPage { page: page(x), pixels: 1, eighth: 0 }).to_vec();
    world.pager.observe(&Feedback { view: other, pages, ..Feedback::default() });
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    for eighth in [7, 0] {
        world.eighth = eighth;
        world.frames_until_converged(0, &gaps);
    }
    let both = world.pager.stats();
    assert!(world.pager.remove_view(other));
    for _ in 0..10 * CYCLE {
        world.frame(0, &[]);
    }
    let alone = world.pager.stats();
    assert_eq!((alone.bias_eighths, alone.wanted_at_bias), (both.bias_eighths, both.wanted_at_bias));
}

/// Nobody names what is there, so that it may make room for something else after all pixels were looked at.
/// Then they are looked at again.
#[test]
fn what_made_room_after_all_pixels_were_looked_at_is_found_to_be_lacking() {
    let mut world = World::new(14);
    world.frames_until_converged(20, &[]);
    world.pager.set_gap_passes(ViewId::MAIN, PASSES);
    world.frames_until_converged(0, &[20]);
    assert!(world.is_there(20), "there is room for it");
    let alone = world.pager.stats();
    let elsewhere = Region::image(0..512, 3968..4096).on_levels(0..=0);
    world.pager.prefetch(page(0).texture(), &elsewhere, Urgency::default()).unwrap();
    (0..4).for_each(|_| world.undrawn_frame());
    assert!(!world.is_there(20) && world.pager.stats().evicted > alone.evicted, "{:?}", world.pager.stats());
    assert!(!world.pager.is_view_converged(ViewId::MAIN) && !world.pager.is_converged());
    let frames = world.frames_until_converged(0, &[20]);
    assert!(world.is_there(20) && frames >= u64::from(PASSES), "{frames}");
    for _ in 0..4 * CYCLE {
        world.frame(0, &[20]);
        assert!(world.pager.is_converged() && world.pager.is_view_converged(ViewId::MAIN), "it ends");
    }
}
