//! Gaps of views that rest: what few pixels need is found once the cycle has nothing missing, is held as long
//! as the view rests, and is there before the view has converged.

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, PageState, Pager,
    TextureNumber, ViewId, WantedPage,
};

const CYCLE: u64 = JITTER_CYCLE as u64;
/// Feedbacks that look at all pixels.
const PASSES: u32 = 8;

fn page(x: u32) -> PageId {
    PageId::new(TextureNumber::new(0).unwrap(), Dims::D2, PagePos::new_2d(0, x, 0)).unwrap()
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
    /// True if all pages of gaps lie behind each other on the one ray that there is.
    is_one_ray: bool,
}

impl World {
    fn new(slots: u32) -> World {
        let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 1000 });
        let pool = pager.add_pool(slots, 1, Some(BiasRule::Solved)).unwrap();
        let geometry = Geometry::new(GeometrySpec::image(4096, 4096)).unwrap();
        pager.add_texture(pool, &geometry, None, None).unwrap();
        World { pager, frame: 0, failing: Vec::new(), loaded: 0, passes: 0, is_one_ray: false }
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
            false => vec![page(cycle)],
        };
        if seeks && self.is_one_ray && !pages.is_empty() {
            // As shaders do: the first ones are passed over, more of them whenever all pixels were looked at.
            let over = self.passes / PASSES % self.pager.gaps_by_turns(ViewId::MAIN);
            pages = vec![pages[(over as usize).min(pages.len() - 1)]];
        }
        self.passes += u32::from(seeks);
        let pages = pages.into_iter().map(|page| WantedPage { page, pixels: 1, eighth: 0 }).collect();
        self.pager.observe(&Feedback { gaps: seeks, ..Feedback::of_pages(self.frame, pages) });
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
        seeks
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
