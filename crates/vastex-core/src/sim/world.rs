//! The world itself: one frame after the other, with what must hold checked at each.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use bytes::Bytes;

use crate::pager::bias::BiasRule;
use crate::pager::decision::Upload;
use crate::pager::event::Event;
use crate::pager::pool::PoolPager;
use crate::pager::{Budgets, Pager};
use crate::record::prefetch_sets::PrefetchSets;
use crate::record::trace::Trace;
use crate::sim::loader::{Loads, Outcome};
use crate::sim::{Log, Path, Random, Sharpness, View};
use crate::table::pool::{PoolError, PoolId};
use crate::table::{PageTable, TableChange, TableEntry, TableImage};
use crate::texture::geometry::{Geometry, GeometrySpec};
use crate::texture::page::{PageId, PagePos, TextureNumber};
use crate::texture::page_set::PageSet;
use crate::wanted::feedback::{Feedback, Need};

/// Frames between a view and its feedback.
const FEEDBACK_FRAMES: u64 = 2;

/// What a world is made from.
#[derive(Clone, Debug)]
pub struct Knobs {
    /// Shape of the texture.
    pub spec: GeometrySpec,
    /// Pixels of the screen.
    pub screen: [u32; 2],
    /// Slots of the pool.
    pub slots: u32,
    /// Bytes of a tile.
    pub tile_bytes: u64,
    /// Upload budget in bytes per frame.
    pub upload_bytes_per_frame: u64,
    /// In-flight budget in tiles.
    pub in_flight_tiles: u64,
    /// How the mip bias is decided.
    pub bias_rule: BiasRule,
    /// True if feedback looks at every pixel of every frame.
    pub complete_feedback: bool,
    /// Frames ahead for which the application predicts what it will see; 0 where it does not.
    pub lead_frames: u64,
    /// What was learnt where, of the world's texture.
    pub prefetch_sets: Option<Arc<PrefetchSets>>,
    /// How the camera moves.
    pub path: Path,
    /// In which way it strays from its path; 0 where it does not.
    pub stray: u64,
    /// Frames after which the camera holds its pose.
    pub hold_after: u64,
    /// The share of the pages that have no tile; with each, its descendants have none.
    pub absent: f64,
    /// The loader.
    pub loads: Loads,
}

impl Knobs {
    /// An image of 32768x16384 texels, a pool of 400 slots, a fast and faithful loader.
    pub fn new(path: Path, seed: u64) -> Knobs {
        Knobs {
            spec: GeometrySpec::image(32768, 16384),
            screen: [640, 360],
            slots: 400,
            tile_bytes: 100,
            upload_bytes_per_frame: 800,
            in_flight_tiles: 64,
            bias_rule: BiasRule::Solved,
            complete_feedback: false,
            lead_frames: 0,
            prefetch_sets: None,
            path,
            stray: 0,
            hold_after: u64::MAX,
            absent: 0.0,
            loads: Loads::new(seed),
        }
    }
}

impl Knobs {
    /// What the camera sees in a frame on its way.
    pub fn view_in(&self, frame: u64) -> View {
        let frame = frame.min(self.hold_after);
        self.path.view(frame).strayed(self.stray, frame)
    }

    /// The trace of so many frames of the camera's way.
    pub fn trace(&self, frames: u64) -> Trace {
        let mut trace = Trace::new();
        let Ok(geometry) = Geometry::new(self.spec) else { return trace };
        let Ok(texture) = trace.add_texture(geometry.clone()) else { return trace };
        for frame in 1..=frames {
            let view = self.view_in(frame);
            let feedback = view.feedback(texture, &geometry, self.screen, frame, self.complete_feedback);
            let added = trace.add_frame_at(feedback.pages, view.place());
            debug_assert_eq!(added, Ok(()), "feedback names pages of the texture in order");
        }
        trace
    }
}

/// A simulated run of one texture: a camera, a loader and a pager. [`World::step`] plays a frame, checks what
/// must hold, and says what does not.
#[derive(Debug)]
pub struct World {
    knobs: Knobs,
    geometry: Geometry,
    present: Option<Arc<PageSet>>,
    texture: TextureNumber,
    /// The pager under test.
    pub pager: Pager,
    /// The world's only pool.
    pool: PoolId,
    /// What a GPU's page table would hold.
    pub table: TableImage,
    /// Frames played.
    pub frame: u64,
    /// Everything that the pager said, with the frame.
    pub events: Vec<(u64, Event)>,
    /// How often the tile of each page was put into a slot.
    pub loads_of: BTreeMap<PageId, u32>,
    /// What the pager decided and told, where somebody wants it.
    pub log: Log,
    /// Loads that were ranked anew while the loader had them.
    pub reranked: u64,
    /// Entries of the page table that the changes of the last frame replaced.
    pub entries_changed: u64,
    /// What is seen, where the camera no longer follows its path.
    look: Option<View>,
    /// How long the pages in view were missing.
    pub sharpness: Sharpness,
    expected: VecDeque<Feedback>,
    in_view: VecDeque<Feedback>,
    newest: Feedback,
    uploaded: Vec<u64>,
    changes: Vec<TableChange>,
}

impl World {
    /// A world at rest; fails where the pool is too small for the texture.
    pub fn new(knobs: Knobs) -> Result<World, PoolError> {
        let budgets = Budgets {
            upload_bytes_per_frame: knobs.upload_bytes_per_frame,
            in_flight_bytes: knobs.in_flight_tiles * knobs.tile_bytes,
        };
        #[expect(clippy::expect_used, reason = "the knobs are the test's own")]
        let geometry = Geometry::new(knobs.spec).expect("a possible texture");
        let mut pager = Pager::new(budgets);
        let pool = pager.add_pool(knobs.slots, knobs.tile_bytes, Some(knobs.bias_rule))?;
        let present = (knobs.absent > 0.0).then(|| {
            // Whether a page has a tile follows from its place, so that the order of asking does not matter.
            let has_tile = |pos: PagePos| {
                let place = pos.coords().iter().fold(u64::from(pos.level), |n, &c| n << 16 ^ u64::from(c));
                !Random::new(place).chance(knobs.absent)
            };
            Arc::new(PageSet::from_pages(&geometry, has_tile))
        });
        let (texture, tail_slot) = pager.add_texture(pool, &geometry, present.clone(), None)?;
        Ok(World {
            table: TableImage::new(&geometry, tail_slot),
            knobs,
            geometry,
            present,
            texture,
            pager,
            pool,
            frame: 0,
            events: Vec::new(),
            loads_of: BTreeMap::new(),
            log: Log::default(),
            reranked: 0,
            entries_changed: 0,
            look: None,
            sharpness: Sharpness::default(),
            expected: VecDeque::new(),
            in_view: VecDeque::new(),
            newest: Feedback::default(),
            uploaded: Vec::new(),
            changes: Vec::new(),
        })
    }

    /// The pool of the world's texture.
    pub fn pool(&self) -> &PoolPager {
        self.pager.pool(self.pool)
    }

    /// Keeps lines of what the pager decides and tells; to be called before the first frame.
    pub fn begin_log(&mut self) {
        self.log.begin();
        if let Some(tail) = self.pool().tail_slot(self.texture) {
            self.log.texture(self.texture, self.geometry.dims(), self.pool, tail);
        }
    }

    /// What the camera sees now.
    pub fn view(&self) -> View {
        self.look.unwrap_or_else(|| self.knobs.view_in(self.frame))
    }

    /// Cuts to another view, from the next frame on, and stays there.
    pub fn cut_to(&mut self, view: View) {
        self.look = Some(view);
    }

    /// The page-table changes of the last frame.
    pub fn table_changes(&self) -> &[TableChange] {
        &self.changes
    }

    /// Holds the camera where it is.
    pub fn hold(&mut self) {
        self.knobs.hold_after = self.knobs.hold_after.min(self.frame);
    }

    /// Plays frames until the pager says that the view has converged, at most `limit`; says how many.
    pub fn run_until_converged(&mut self, limit: u64) -> Result<u64, String> {
        for frames in 1..=limit {
            self.step()?;
            if self.pager.is_converged() {
                return Ok(frames);
            }
        }
        Err(format!("not converged after {limit} frames: {:?}", self.pager.stats()))
    }

    /// Plays one frame.
    pub fn step(&mut self) -> Result<(), String> {
        self.frame += 1;
        self.log.frame(self.frame);
        self.pager.begin_frame(self.frame);
        let (screen, complete) = (self.knobs.screen, self.knobs.complete_feedback);
        self.in_view.push_back(self.view().feedback(
            self.texture,
            &self.geometry,
            screen,
            self.frame,
            complete,
        ));
        if self.in_view.front().is_some_and(|feedback| feedback.frame + FEEDBACK_FRAMES <= self.frame)
            && let Some(feedback) = self.in_view.pop_front()
        {
            self.pager.observe(&feedback);
            self.newest = feedback;
        }
        self.predict();
        self.expect_what_was_learnt();
        self.load()?;
        self.upload()?;
        self.sharpness.note(self.frame, self.pager.pool(self.pool));
        self.log.bias(self.pool, self.pager.pool(self.pool).bias_eighths());
        while let Some(event) = self.pager.poll_event() {
            self.log.event(&event);
            self.events.push((self.frame, event));
        }
        self.check_table()
    }

    /// The feedback of what the camera will see if it goes on as it does, as late as any other.
    fn predict(&mut self) {
        let lead = self.knobs.lead_frames;
        if lead == 0 || self.frame < 3 {
            return;
        }
        let before = [2, 1].map(|ago| self.knobs.view_in(self.frame - ago));
        let expected = self.view().expected(&before, lead + FEEDBACK_FRAMES);
        let screen = self.knobs.screen;
        let feedback = expected.feedback(self.texture, &self.geometry, screen, self.frame, false);
        self.expected.push_back(feedback);
        if self.expected.front().is_some_and(|feedback| feedback.frame + FEEDBACK_FRAMES <= self.frame)
            && let Some(feedback) = self.expected.pop_front()
        {
            self.pager.expect(&feedback);
        }
    }

    /// What was wanted before where the camera is and where it is heading.
    fn expect_what_was_learnt(&mut self) {
        let Some(sets) = &self.knobs.prefetch_sets else { return };
        let place = self.view().place();
        let before = self.knobs.view_in(self.frame.saturating_sub(1)).place();
        let step = std::array::from_fn(|axis| place[axis] - before[axis]);
        self.pager.expect(&sets.expected(place, step, &[self.texture]));
    }

    fn load(&mut self) -> Result<(), String> {
        for (page, outcome) in self.knobs.loads.arrivals(self.frame) {
            self.log.arrived(page, outcome);
            match outcome {
                Outcome::Tile => self.pager.tile_ready(page, Bytes::from_static(b"tile")),
                Outcome::Failure => self.pager.tile_failed(page, "simulated"),
                Outcome::Cancelled => self.pager.tile_cancelled(page),
            }
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.log.cancel(page);
            self.knobs.loads.cancel(page);
        }
        while let Some(request) = self.pager.poll_rerank() {
            self.knobs.loads.rerank(request.page, request.rank);
            self.log.rerank(request.page, &self.knobs.loads);
            self.reranked += 1;
        }
        while let Some(request) = self.pager.poll_request() {
            if !self.has_tile(request.pos) {
                return Err(format!("frame {}: {} has no tile and was asked for", self.frame, request.pos));
            }
            self.knobs.loads.request(request.page, request.rank);
            self.log.request(request.page, &self.knobs.loads);
        }
        self.begin_loads()
    }

    /// No page in view waits for one that is not.
    fn begin_loads(&mut self) -> Result<(), String> {
        let begun = self.knobs.loads.begin(self.frame);
        begun.iter().for_each(|page| self.log.begun(*page));
        let is_in_view = |page: &PageId| self.pool().is_for_view(*page);
        let ahead = begun.iter().find(|page| !is_in_view(page));
        match ahead.and_then(|ahead| Some((ahead, self.knobs.loads.waiting().find(is_in_view)?))) {
            Some((ahead, waits)) => {
                Err(format!("frame {}: {waits:?} is in view and waits for {ahead:?}", self.frame))
            }
            None => Ok(()),
        }
    }

    fn has_tile(&self, pos: PagePos) -> bool {
        self.present.as_ref().is_none_or(|present| present.contains(pos))
    }

    /// Walks up from a page until there is a tile; from that level on, anything will do.
    fn stand_in(&self, pos: PagePos, need: Need) -> (PagePos, Need) {
        match self.geometry.parent(pos) {
            Some(parent) if !self.has_tile(pos) => self.stand_in(parent, Need::new(parent.level, 0)),
            _ => (pos, need),
        }
    }

    fn upload(&mut self) -> Result<(), String> {
        let mut bytes = 0;
        while let Some((pool, upload)) = self.pager.poll_upload() {
            bytes += self.knobs.tile_bytes;
            self.log.upload(pool, &upload);
            *self.loads_of.entry(upload.page).or_default() += 1;
            self.check_eviction(&upload)?;
        }
        self.uploaded.push(bytes);
        self.check_upload_budget()?;
        self.pager.take_table_changes(&mut self.changes);
        self.log.table_changes(&self.changes);
        let changes = self.changes.iter();
        self.entries_changed = changes.map(|change| self.table.apply(&self.geometry, change)).sum();
        Ok(())
    }

    /// A page that the newest feedback wants, at the bias in force, is not evicted, nor an ancestor of one.
    fn check_eviction(&self, upload: &Upload) -> Result<(), String> {
        let Some(evicted) = upload.evicted else { return Ok(()) };
        let gone = evicted.pos(self.geometry.dims());
        for wanted in &self.newest.pages {
            let pos = wanted.page.pos(self.geometry.dims());
            let (pos, need) = self.stand_in(pos, Need::new(pos.level, wanted.eighth));
            let level = need.level_at(self.pool().bias_eighths());
            let at_bias = self.geometry.ancestor(pos, level.min(self.geometry.coarsest()));
            if gone.level >= at_bias.level && self.geometry.ancestor(at_bias, gone.level) == gone {
                return Err(format!("frame {}: {gone} was evicted while {at_bias} is in view", self.frame));
            }
        }
        Ok(())
    }

    /// Over any frames up to now, the uploads keep to the budget.
    fn check_upload_budget(&self) -> Result<(), String> {
        let (budget, tile) = (self.knobs.upload_bytes_per_frame, self.knobs.tile_bytes);
        let mut sum = 0;
        for (n, bytes) in (1..).zip(self.uploaded.iter().rev()) {
            sum += bytes;
            if sum > n * budget + tile.max(4 * budget) {
                return Err(format!("frame {}: {sum} bytes uploaded in {n} frames of {budget}", self.frame));
            }
        }
        Ok(())
    }

    /// What is resident, by what the pager says of its slots, is exactly what the table leads to.
    fn check_table(&self) -> Result<(), String> {
        let mut in_slot = vec![None; self.knobs.slots as usize];
        for (page, slot) in self.pool().resident() {
            let entry = TableEntry::new(page.level(), slot);
            let pos = page.pos(self.geometry.dims());
            if self.table.lookup(pos) != entry {
                return Err(format!("frame {}: the table does not lead to {pos}", self.frame));
            }
            in_slot[slot.index() as usize] = Some(entry);
        }
        let is_known = |entry: &TableEntry| in_slot.get(entry.slot().index() as usize) == Some(&Some(*entry));
        match self.table.entries().iter().all(is_known) {
            true => Ok(()),
            false => Err(format!("frame {}: the table names slots that are gone", self.frame)),
        }
    }

    /// Loads under way.
    pub fn loads_under_way(&self) -> usize {
        self.knobs.loads.under_way()
    }

    /// The loader, to change its mood while the world runs.
    pub fn loads_mut(&mut self) -> &mut Loads {
        &mut self.knobs.loads
    }
}
