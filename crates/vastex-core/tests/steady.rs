//! In the steady state a frame's decision allocates nothing: not the pager, and not the compaction of
//! feedback. And whatever comes and goes, memory does not grow with the frames.
//!
//! Cameras go round loops, and the pools hold less than what lies along them, so that every frame loads,
//! uploads and evicts.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not take for tests")]

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use vastex_core::shader_constants::FEEDBACK_WANTED;
use vastex_core::sim::{View, contents_of_chance};
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, FeedbackCompactor, Geometry, GeometrySpec, PageContents, PageId,
    PagePos, PageSet, Pager, PoolId, Region, TableChange, TextureNumber, Urgency, ViewId, WantedPage, checks,
};

/// Frames of a loop: whole jitter cycles.
const LOOP: u64 = 160;
/// Feedback texels along x and y.
const TARGET: [u32; 2] = [60, 34];

/// What a camera sees of one texture on the loop, texel by texel as a feedback pass writes it.
fn target(texture: TextureNumber, geometry: &Geometry, frame: u64) -> Vec<[u32; 4]> {
    let angle = frame as f64 / LOOP as f64 * std::f64::consts::TAU;
    let view = View { centre: [0.5 + 0.3 * angle.cos(), 0.55 + 0.3 * angle.sin()], width: 0.05, tilt: 3.0 };
    let jitter = [frame as u32 % 8, frame as u32 * 5 % 8];
    let texel = |n: u32| {
        let pixel = [n % TARGET[0] * 8 + jitter[0], n / TARGET[0] * 8 + jitter[1]];
        match view.want(texture, geometry, TARGET.map(|side| side * 8), pixel) {
            Some((page, eighth)) => {
                let bits = page.to_bits();
                [bits as u32, (bits >> 32) as u32, u32::from(eighth), FEEDBACK_WANTED]
            }
            None => [0; 4],
        }
    };
    (0..TARGET[0] * TARGET[1]).map(texel).collect()
}

/// Everything that a frame decides, in memory that is kept.
struct Loop {
    pager: Pager,
    targets: Vec<Vec<[u32; 4]>>,
    compactor: FeedbackCompactor,
    /// Of the main view, and of one beside it.
    feedback: [Feedback; 2],
    changes: Vec<TableChange>,
    frame: u64,
    /// Frames that a load takes, those under way, and how many of them were ranked anew.
    latency_frames: u64,
    under_way: VecDeque<(u64, PageId)>,
    reranked: u64,
}

impl Loop {
    fn new() -> Loop {
        let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 16_000, in_flight_bytes: 32_000 });
        let geometry = Geometry::new(GeometrySpec::image(32_768, 16_384)).unwrap();
        let small_pages =
            Geometry::new(GeometrySpec { page: 32, ..GeometrySpec::image(32_768, 16_384) }).unwrap();
        let sparse = PageSet::from_pages(&geometry, |pos| pos.level > 1 || (pos.x + pos.y) % 5 != 0);
        // One pool is large enough for its victims to be looked for in turns.
        let kinds = [
            (&small_pages, 4500, 100, None, 0.0),
            (&small_pages, 1700, 100, None, 0.7),
            (&geometry, 300, 70, None, 0.0),
            (&geometry, 320, 70, Some(Arc::new(sparse)), 0.2),
        ];
        let textures: Vec<(TextureNumber, &Geometry)> = kinds
            .into_iter()
            .map(|(geometry, slots, tile_bytes, present, share)| {
                let pool = pager.add_pool(slots, tile_bytes, Some(BiasRule::default())).unwrap();
                let contents = (share > 0.0).then(|| Arc::new(contents_of_chance(geometry, 7, share)));
                (pager.add_texture(pool, geometry, present, contents).unwrap().0, geometry)
            })
            .collect();
        // The last is seen with a half of it, of pages half as large, in a pool of its own.
        let half = GeometrySpec { page: 64, ..GeometrySpec::image(16_384, 8192) };
        let pool = pager.add_pool(1150, 50, Some(BiasRule::default())).unwrap();
        let (half, _) = pager.add_texture(pool, &Geometry::new(half).unwrap(), None, None).unwrap();
        let group = pager.add_group(&[textures[3].0, half]).unwrap();
        let seen = [textures[0], textures[1], textures[2], (group.number(), textures[3].1)];
        let all =
            |frame| seen.iter().flat_map(|&(texture, geometry)| target(texture, geometry, frame)).collect();
        Loop {
            pager,
            targets: (0..LOOP).map(all).collect(),
            compactor: FeedbackCompactor::new(),
            feedback: Default::default(),
            changes: Vec::new(),
            frame: 0,
            latency_frames: 0,
            under_way: VecDeque::with_capacity(1 << 10),
            reranked: 0,
        }
    }

    fn play_frame(&mut self, tile: &Bytes) {
        self.frame += 1;
        let [main, beside] = &mut self.feedback;
        self.compactor.compact(self.frame, &self.targets[(self.frame % LOOP) as usize], main);
        self.pager.begin_frame(self.frame);
        // The view beside it is some frames ahead and drawn in every fourth.
        let is_drawn = beside.view != ViewId::MAIN && self.frame.is_multiple_of(4);
        if is_drawn {
            self.compactor.compact(self.frame, &self.targets[((self.frame + 8) % LOOP) as usize], beside);
        }
        self.pager.observe_views(&self.feedback[..if is_drawn { 2 } else { 1 }]);
        while let Some(page) = self.pager.poll_cancel() {
            self.under_way.retain(|(_, loading)| *loading != page);
            self.pager.tile_cancelled(page);
        }
        while self.pager.poll_rerank().is_some() {
            self.reranked += 1;
        }
        while let Some(request) = self.pager.poll_request() {
            self.under_way.push_back((self.frame + self.latency_frames, request.page));
        }
        while let Some((_, page)) = self.under_way.pop_front_if(|(due, _)| *due <= self.frame) {
            self.pager.tile_ready(page, tile.clone());
        }
        while self.pager.poll_upload().is_some() {}
        self.pager.take_table_changes(&mut self.changes);
        while self.pager.poll_event().is_some() {}
        self.pager.stats();
    }
}

#[test]
fn a_frame_of_a_loop_allocates_nothing() {
    let mut world = Loop::new();
    play_rounds(&mut world);
    assert_eq!(world.pager.stats().bias_eighths, 0);
}

#[test]
fn nor_does_one_of_two_views() {
    let mut world = Loop::new();
    world.feedback[1].view = world.pager.add_view(0.5).unwrap();
    play_rounds(&mut world);
}

#[test]
fn nor_does_one_in_which_loads_are_ranked_anew() {
    let mut world = Loop::new();
    world.latency_frames = 3;
    play_rounds(&mut world);
    assert!(world.reranked > 3 * LOOP, "{}", world.reranked);
}

fn play_rounds(world: &mut Loop) {
    let tile = Bytes::from_static(b"tile");
    // The first round fills the pools, the second is the first with full ones; where pages share slots, and
    // textures what is in flight, it takes some more until what waits in a frame has been at its most.
    (0..5 * LOOP).for_each(|_| checks::paused(|| world.play_frame(&tile)));
    for round in 6..9 {
        let before = world.pager.stats();
        for _ in 0..LOOP {
            let counted = allocation_counter::measure(|| checks::paused(|| world.play_frame(&tile)));
            assert_eq!(counted.count_total, 0, "frame {} of round {round}: {counted:?}", world.frame);
        }
        let round_of = world.pager.stats().since(&before);
        let evicted: Vec<u64> = world.pager.pools().map(|pager| pager.stats().evicted).collect();
        assert!(evicted.iter().all(|&evicted| evicted > LOOP), "{evicted:?}");
        assert!(round_of.loaded > 20 * LOOP, "{round_of:?}");
    }
}

/// Textures that come and go, a view that never comes back, pages that cannot be had, predictions, prefetches
/// whose ends nobody asks for, contents that change: for as long as one likes.
struct Flight {
    pager: Pager,
    pool: PoolId,
    image: Geometry,
    ground: TextureNumber,
    passing: Option<TextureNumber>,
    contents: Arc<PageContents>,
    under_way: VecDeque<(u64, PageId)>,
    changes: Vec<TableChange>,
    frame: u64,
}

impl Flight {
    fn new() -> Flight {
        let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 12, in_flight_bytes: 40 });
        let pool = pager.add_pool(160, 1, Some(BiasRule::Solved)).unwrap();
        let ground = Geometry::new(GeometrySpec::image(1 << 20, 1 << 16)).unwrap();
        let (ground, _) = pager.add_texture(pool, &ground, None, None).unwrap();
        let image = Geometry::new(GeometrySpec::image(4096, 4096)).unwrap();
        let contents = Arc::new(contents_of_chance(&image, 7, 0.4));
        let (under_way, changes) = (VecDeque::new(), Vec::new());
        Flight { pager, pool, image, ground, passing: None, contents, under_way, changes, frame: 0 }
    }

    /// Nine pages along a way over all of the ground, and four of what passes.
    fn feedback(&self, frame: u64) -> Feedback {
        let page = |texture, x, y| PageId::new(texture, Dims::D2, PagePos::new_2d(0, x, y)).unwrap();
        let (along, row) = ((frame / 3) as u32, 3 * (frame / 3 / 8000) as u32);
        let ground = (0..9).map(|n| page(self.ground, (along + n % 3) % 8000, row + n / 3));
        let at = frame as u32 % 40 / 4;
        let passing = self
            .passing
            .into_iter()
            .flat_map(|texture| (0..4).map(move |n| page(texture, 2 * at + n % 2, 2 * at + n / 2)));
        let pages = ground.chain(passing).map(|page| WantedPage { page, pixels: 9, eighth: 0 });
        Feedback::of_pages(frame, pages.collect())
    }

    fn play_frame(&mut self) {
        self.frame += 1;
        let frame = self.frame;
        self.pager.begin_frame(frame);
        self.come_and_go();
        self.pager.observe(&self.feedback(frame));
        self.pager.feedback_under_way(None);
        if frame.is_multiple_of(4) {
            self.pager.expect(&self.feedback(frame + 12));
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.under_way.retain(|(_, loading)| *loading != page);
            self.pager.tile_cancelled(page);
        }
        while self.pager.poll_rerank().is_some() {}
        while let Some(request) = self.pager.poll_request() {
            self.under_way.push_back((frame + 2, request.page));
        }
        while let Some((_, page)) = self.under_way.pop_front_if(|(due, _)| *due <= frame) {
            match page.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61 {
                0 | 1 => self.pager.tile_failed(page, "none"),
                _ => self.pager.tile_ready(page, Bytes::from_static(b"tile")),
            }
        }
        while self.pager.poll_upload().is_some() {}
        self.pager.take_table_changes(&mut self.changes);
    }

    fn come_and_go(&mut self) {
        let frame = self.frame;
        if frame.is_multiple_of(40) {
            if let Some(gone) = self.passing.take() {
                self.pager.remove_texture(gone, frame);
            }
            let contents = Some(self.contents.clone());
            self.passing = Some(self.pager.add_texture(self.pool, &self.image, None, contents).unwrap().0);
        }
        let Some(passing) = self.passing else { return };
        let side = frame as u32 % 3000;
        let part = Region::image(side..side + 400, side..side + 200);
        match frame % 40 {
            7 | 27 => {
                let urgency = Urgency { priority: 0, deadline: Some(frame + 9) };
                self.pager.prefetch(passing, &part, urgency).unwrap();
            }
            13 => drop(self.pager.invalidate(passing, &part)),
            _ => {}
        }
    }
}

#[test]
fn memory_is_flat_over_a_hundred_thousand_frames_of_coming_and_going() {
    let mut flight = Flight::new();
    let mut play = |frames: u64| {
        let work = || (0..frames).for_each(|_| checks::paused(|| flight.play_frame()));
        allocation_counter::measure(work).bytes_current
    };
    // Until every table has been as large as it ever is.
    let first = play(40_000);
    let rest = play(60_000);
    assert!(rest <= 16 << 10, "{first} bytes in the first 40,000 frames, {rest} more in the rest");
    let stats = flight.pager.stats();
    assert!(stats.failures > 50_000 && stats.evicted > 100_000 && stats.shared > 1000, "{stats:?}");
}

/// What a source says of a texture's pages is a number for each: up to gigabytes, which it and the pager
/// share.
#[test]
fn content_that_changes_copies_no_page_list() {
    let image = Geometry::new(GeometrySpec { page: 16, ..GeometrySpec::image(16_384, 16_384) }).unwrap();
    let contents = Arc::new(PageContents::new(&image, Vec::new(), 300, |pos| Some(pos.x % 300)));
    let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1, in_flight_bytes: 1 });
    let pool = pager.add_pool(100, 1, Some(BiasRule::Solved)).unwrap();
    let (texture, _) = pager.add_texture(pool, &image, None, Some(contents)).unwrap();
    let part = Region::image(0..64, 0..64);
    let mut invalidate = |region: &Region| {
        allocation_counter::measure(|| assert!(checks::paused(|| pager.invalidate(texture, region)) <= 1))
    };
    let counted = invalidate(&part);
    assert!(counted.bytes_total < 64 << 10, "{counted:?}");
    // Nor does all of it take more than a fraction: two bytes a page had been copied, and eight listed.
    let counted = invalidate(&Region::whole());
    let pages = image.page_count();
    assert!(counted.bytes_max < pages, "{counted:?} for {pages} pages");
}
