//! A pool, a camera that moves and rests, and how often each tile was uploaded.

use std::collections::{BTreeMap, VecDeque};

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::sim::Random;
use vastex_core::{
    BiasRule, Budgets, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, PageState, Pager, PoolId,
    TextureNumber, ViewId, WantedPage,
};

pub(super) const CYCLE: u64 = JITTER_CYCLE as u64;
/// Feedbacks that look at all pixels.
pub(super) const PASSES: u32 = 8;
/// Pages of level 0 along a side, and rays of a picture.
pub(super) const SIDE: u64 = 32;
pub(super) const RAYS: u64 = 240;
/// Frames after which feedback is read.
pub(super) const READ_AFTER: usize = 2;
pub(super) const TILE: usize = 100;
/// Frames in which a camera that rests has all, without those in which something is on its way to it.
pub(super) const MOST_FRAMES: u64 = 1000;
/// All frames in which it has all, whatever is on its way.
pub(super) const MOST_OF_ALL: u64 = 200 * CYCLE;

/// What a ray needs: a page, and the part of a level from it on that is wanted, in eighths.
#[derive(Clone, Copy)]
pub(super) struct Need {
    pub(super) pos: PagePos,
    pub(super) eighth: u8,
}

/// What the rays of a picture need, and in how many cycles feedback names all that those of its pixels do.
pub(super) struct Picture {
    pub(super) rays: Vec<Vec<Need>>,
    pub(super) turns: u64,
}

impl Picture {
    /// Rays somewhere, each of some pages.
    pub(super) fn new(random: &mut Random) -> Picture {
        let (at, spread) = Picture::place(random);
        Picture::of(random, at, spread)
    }

    /// Where rays may go, and how far apart.
    pub(super) fn place(random: &mut Random) -> ([u64; 2], u64) {
        ([(); 2].map(|()| random.below(SIDE)), 1 + random.below(SIDE / 2))
    }

    pub(super) fn of(random: &mut Random, at: [u64; 2], spread: u64) -> Picture {
        let most = 1 + random.below(12);
        let mut need = || {
            let [x, y] = at.map(|at| (at + random.below(spread)).min(SIDE - 1));
            let level = random.below(3).saturating_sub(1) as u8;
            let pos = PagePos::new_2d(level, (x >> level) as u32, (y >> level) as u32);
            Need { pos, eighth: random.below(8) as u8 }
        };
        let rays = (0..RAYS).map(|_| (0..most).map(|_| need()).collect()).collect();
        Picture { rays, turns: 1 + random.below(4) }
    }
}

pub(super) struct World {
    pub(super) pager: Pager,
    pub(super) geometry: Geometry,
    pub(super) pool: PoolId,
    pub(super) number: TextureNumber,
    pub(super) frame: u64,
    /// What is on its way, and in which frame it comes.
    pub(super) coming: VecDeque<(u64, PageId)>,
    pub(super) latency: u64,
    /// Feedback that was not read yet, of all views that were drawn in a frame.
    pub(super) drawn: VecDeque<Vec<Feedback>>,
    /// How often the tile of each page was uploaded.
    pub(super) uploads: BTreeMap<PageId, u32>,
}

impl World {
    pub(super) fn new(random: &mut Random, slots: u32) -> World {
        let budgets = Budgets {
            upload_bytes_per_frame: TILE as u64 * (1 + random.below(8)),
            in_flight_bytes: TILE as u64 * (1 + random.below(32)),
        };
        let mut pager = Pager::new(budgets);
        let side = (SIDE * 128) as u32;
        let geometry = Geometry::new(GeometrySpec { page: 128, ..GeometrySpec::image(side, side) }).unwrap();
        let pool = pager.add_pool(slots, TILE as u64, Some(BiasRule::Solved)).unwrap();
        let (number, _) = pager.add_texture(pool, &geometry, None, None).unwrap();
        let (coming, drawn, uploads) = (VecDeque::new(), VecDeque::new(), BTreeMap::new());
        let (frame, latency) = (0, random.below(6));
        World { pager, geometry, pool, number, frame, coming, latency, drawn, uploads }
    }

    pub(super) fn id(&self, pos: PagePos) -> PageId {
        PageId::new(self.number, Dims::D2, pos).unwrap()
    }

    /// Returns true if what a ray needs is not there at the level that the bias leaves of it.
    pub(super) fn lacks(&self, need: &Need) -> bool {
        let eighths = u32::from(need.pos.level) * 8
            + u32::from(need.eighth)
            + u32::from(self.pager.stats().bias_eighths);
        let level = (eighths / 8).min(u32::from(self.geometry.tail().first_level())) as u8;
        let shown = self.geometry.ancestor(need.pos, level);
        level < self.geometry.tail().first_level()
            && !matches!(self.pager.state(self.id(shown)), PageState::Resident(_))
    }

    /// What a frame names: where gaps are looked for, of an eighth of the rays something that each lacks;
    /// else what a quarter of all rays needs in a cycle, and of each of them a part by turns.
    pub(super) fn named(&self, picture: &Picture, seeks: bool) -> Vec<Need> {
        let rays = || (0..).zip(&picture.rays);
        let (frame, passes) = (self.frame, u64::from(PASSES));
        match seeks {
            true => {
                let over = frame / passes % u64::from(self.pager.gaps_by_turns(ViewId::MAIN));
                let lacked = |ray: &Vec<Need>| {
                    ray.iter().filter(|need| self.lacks(need)).take(over as usize + 1).last().copied()
                };
                let looked_at = rays().filter(|(n, _)| n % passes == frame % passes);
                looked_at.filter_map(|(_, ray)| lacked(ray)).collect()
            }
            false => {
                let looked_at = rays().filter(|(n, _)| n % (4 * CYCLE) == frame % CYCLE);
                let turn = (frame / CYCLE % picture.turns) as usize;
                let of_turn = |ray: &Vec<Need>| {
                    ray.iter().skip(turn).step_by(picture.turns as usize).copied().collect::<Vec<_>>()
                };
                looked_at.flat_map(|(_, ray)| of_turn(ray)).collect()
            }
        }
    }

    pub(super) fn feedback(&mut self, view: ViewId, picture: &Picture) -> Feedback {
        let seeks = self.pager.looks_for_gaps(view);
        let mut pages: BTreeMap<PageId, (u32, u8)> = BTreeMap::new();
        for need in self.named(picture, seeks) {
            let (pixels, eighth) = pages.entry(self.id(need.pos)).or_insert((0, need.eighth));
            (*pixels, *eighth) = (*pixels + 1, need.eighth.min(*eighth));
        }
        let wanted = pages.into_iter().map(|(page, (pixels, eighth))| WantedPage { page, pixels, eighth });
        Feedback { view, gaps: seeks, ..Feedback::of_pages(self.frame, wanted.collect()) }
    }

    pub(super) fn frame(&mut self, picture: &Picture) {
        self.frame_of(&[(ViewId::MAIN, picture)]);
    }

    /// A frame in which these views are drawn.
    pub(super) fn frame_of(&mut self, drawn: &[(ViewId, &Picture)]) {
        self.frame += 1;
        self.pager.begin_frame(self.frame);
        let feedbacks = drawn.iter().map(|(view, picture)| self.feedback(*view, picture)).collect();
        self.drawn.push_back(feedbacks);
        if self.drawn.len() > READ_AFTER
            && let Some(read) = self.drawn.pop_front()
        {
            self.pager.observe_views(&read);
        }
        while self.coming.front().is_some_and(|(at, _)| *at <= self.frame)
            && let Some((_, page)) = self.coming.pop_front()
        {
            self.pager.tile_ready(page, vec![0; TILE].into());
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.coming.retain(|(_, coming)| *coming != page);
            self.pager.tile_cancelled(page);
        }
        while self.pager.poll_rerank().is_some() {}
        while let Some(request) = self.pager.poll_request() {
            self.coming.push_back((self.frame + self.latency, request.page));
        }
        while let Some((_, upload)) = self.pager.poll_upload() {
            *self.uploads.entry(upload.page).or_default() += 1;
        }
    }

    /// Begins a frame in which nothing is drawn.
    pub(super) fn begin_frame(&mut self) {
        self.frame += 1;
        self.pager.begin_frame(self.frame);
    }

    pub(super) fn moves_to(&mut self, picture: &Picture, frames: u64) {
        self.pager.set_gap_passes(ViewId::MAIN, 0);
        self.pager.set_view_turns(ViewId::MAIN, picture.turns as u32);
        (0..frames).for_each(|_| self.frame(picture));
    }

    /// Gives the frames that it takes until all is there at rest, and the mip bias then.
    pub(super) fn moves_and_rests(&mut self, random: &mut Random) -> Result<([u64; 2], Picture), String> {
        for _ in 0..1 + random.below(3) {
            let picture = Picture::new(random);
            self.moves_to(&picture, random.below(8 * CYCLE));
        }
        let picture = Picture::new(random);
        let frames = self.rests_at(&picture)?;
        Ok(([frames, u64::from(self.pager.stats().bias_eighths)], picture))
    }

    /// Comes to rest; gives how many frames it takes until all is there.
    pub(super) fn rests_at(&mut self, picture: &Picture) -> Result<u64, String> {
        self.pager.set_view_turns(ViewId::MAIN, picture.turns as u32);
        self.pager.set_gap_passes(ViewId::MAIN, PASSES);
        // What was drawn of before is read by then.
        (0..READ_AFTER).for_each(|_| self.frame(picture));
        self.uploads.clear();
        let frames = self.converges(picture)?;
        let twice: Vec<_> = self.uploads.iter().filter(|(_, uploads)| **uploads > 1).collect();
        match twice.is_empty() {
            true => Ok(frames),
            false => Err(format!("of {} pages uploaded twice: {twice:?}", self.uploads.len())),
        }
    }

    /// Gives how many frames it takes until all is there, and stays so, for every ray.
    pub(super) fn converges(&mut self, picture: &Picture) -> Result<u64, String> {
        let (mut frames, mut idle, mut converged_for) = (0, 0, 0);
        while converged_for < 4 * CYCLE {
            self.frame(picture);
            frames += 1;
            idle += u64::from(self.coming.is_empty());
            converged_for = if self.pager.is_view_converged(ViewId::MAIN) { converged_for + 1 } else { 0 };
            // A rest that is not settled by itself takes more.
            if idle > MOST_FRAMES || frames > MOST_OF_ALL {
                return Err(format!("does not converge: {:?}", self.pager.stats()));
            }
        }
        let lacking = picture.rays.iter().flatten().filter(|need| self.lacks(need)).count();
        if lacking > 0 {
            return Err(format!("{lacking} needs are lacking: {:?}", self.pager.stats()));
        }
        Ok(frames - converged_for)
    }
}
