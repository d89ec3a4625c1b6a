//! Many textures in several pools: the simulated world of [`Pager`].
//!
//! Every texture has a camera of its own in each view; one loader serves all. [`Crowd::step`] plays one frame
//! and checks what must hold: the budgets are kept to by all pools together, a pool holds pages of its own
//! textures only, no page in view is evicted, the page table of every texture leads to what is resident,
//! every ticket ends once, and what is pinned stays.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use crate::pager::bias::BiasRule;
use crate::pager::event::Event;
use crate::pager::tickets::{AskError, Progress, Ticket, TicketState, Urgency};
use crate::pager::{Budgets, Pager};
use crate::residency::PageState;
use crate::sim::contents::Contents;
use crate::sim::loader::{Loads, Outcome};
use crate::sim::{Log, Path, Random};
use crate::table::pool::{PoolError, PoolId, Slot};
use crate::table::{TableChange, TableImage};
use crate::texture::geometry::page_id;
use crate::texture::geometry::{Geometry, GeometrySpec};
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::page_contents::PageContents;
use crate::texture::region::{Reach, Region};
use crate::wanted::feedback::Feedback;
use crate::wanted::groups::{GroupError, GroupNumber};
use crate::wanted::view::ViewId;

mod checks;
mod watch;

use watch::Beside;
pub use watch::Watch;

/// A texture of the crowd.
#[derive(Debug)]
struct Member {
    texture: TextureNumber,
    pool: PoolId,
    geometry: Geometry,
    path: Path,
    table: TableImage,
}

/// Many textures in several pools under one pager; [`Crowd::step`] plays a frame and checks what must hold.
#[derive(Debug)]
pub struct Crowd {
    /// The pager under test.
    pub pager: Pager,
    /// The loader, to change its mood while the world runs.
    pub loads: Loads,
    /// Frames played.
    pub frame: u64,
    /// Everything that the pager said, with the frame.
    pub events: Vec<(u64, Event)>,
    /// What the pager decided and told, where somebody wants it.
    pub log: Log,
    budgets: Budgets,
    screen: [u32; 2],
    random: Random,
    /// Whether the cameras hold their poses, and since when.
    held: Option<u64>,
    members: Vec<Member>,
    groups: Vec<(GroupNumber, Path)>,
    contents: Contents,
    /// Tickets that have not ended.
    pub tickets: BTreeSet<Ticket>,
    /// Tickets that have ended, and how.
    pub ended: Vec<(Ticket, Progress)>,
    /// Pins that are all here, with their pages.
    pinned: Vec<(Ticket, Vec<PageId>)>,
    beside: Vec<Beside>,
    in_view: VecDeque<Feedback>,
    /// The newest feedback of each view.
    newest: BTreeMap<ViewId, Feedback>,
    largest_tile: u64,
    uploaded: Vec<u64>,
    changes: Vec<TableChange>,
}

impl Crowd {
    /// Nobody is there yet. Each texture will have a picture of `screen` pixels.
    pub fn new(budgets: Budgets, screen: [u32; 2], seed: u64) -> Crowd {
        Crowd {
            pager: Pager::new(budgets),
            loads: Loads::new(seed),
            frame: 0,
            events: Vec::new(),
            log: Log::default(),
            budgets,
            screen,
            random: Random::new(seed),
            held: None,
            members: Vec::new(),
            groups: Vec::new(),
            contents: Contents::default(),
            tickets: BTreeSet::new(),
            ended: Vec::new(),
            pinned: Vec::new(),
            beside: Vec::new(),
            in_view: VecDeque::new(),
            newest: BTreeMap::new(),
            largest_tile: 0,
            uploaded: Vec::new(),
            changes: Vec::new(),
        }
    }

    /// Adds a pool; see [`Pager::add_pool`].
    pub fn add_pool(
        &mut self,
        slots: u32,
        tile_bytes: u64,
        mip_bias: Option<BiasRule>,
    ) -> Result<PoolId, PoolError> {
        self.largest_tile = self.largest_tile.max(tile_bytes);
        self.pager.add_pool(slots, tile_bytes, mip_bias)
    }

    /// Adds a texture of which every page is like no other, seen along `path`.
    pub fn add(&mut self, pool: PoolId, spec: GeometrySpec, path: Path) -> Result<TextureNumber, PoolError> {
        self.add_with(pool, spec, path, |_| None)
    }

    /// Adds a texture that may say which of its pages are the same.
    pub fn add_with(
        &mut self,
        pool: PoolId,
        spec: GeometrySpec,
        path: Path,
        contents_of: impl FnOnce(&Geometry) -> Option<PageContents>,
    ) -> Result<TextureNumber, PoolError> {
        #[expect(clippy::expect_used, reason = "the shape is the test's own")]
        let geometry = Geometry::new(spec).expect("a possible texture");
        let contents = contents_of(&geometry).map(Arc::new);
        let (texture, tail_slot) = self.pager.add_texture(pool, &geometry, None, contents.clone())?;
        if let Some(contents) = contents {
            self.contents.add(texture, geometry.dims(), contents);
        }
        self.log.texture(texture, geometry.dims(), pool, tail_slot);
        let tail = page_id(texture, &geometry, geometry.tail_pos());
        tail.into_iter().for_each(|tail| self.contents.show_as_it_is(pool, tail_slot, tail));
        let table = TableImage::new(&geometry, tail_slot);
        self.members.push(Member { texture, pool, geometry, path, table });
        Ok(texture)
    }

    /// Removes a texture, of those there are.
    pub fn remove(&mut self, texture: TextureNumber) -> Result<(), String> {
        if !self.pager.remove_texture(texture, self.frame) || self.pager.remove_texture(texture, self.frame) {
            return Err(format!("frame {}: {texture:?} could not be removed, or twice", self.frame));
        }
        self.members.retain(|member| member.texture != texture);
        self.contents.forget(texture);
        for newest in self.newest.values_mut() {
            newest.pages.retain(|wanted| wanted.page.texture() != texture);
        }
        self.pinned.retain(|(_, pages)| pages.iter().all(|page| page.texture() != texture));
        self.note_ended()
    }

    /// Makes a group of textures that there are, seen along `path`; each of them is seen alone as well.
    pub fn group(&mut self, members: &[TextureNumber], path: Path) -> Result<GroupNumber, GroupError> {
        let group = self.pager.add_group(members)?;
        self.groups.push((group, path));
        Ok(group)
    }

    /// Takes a group apart, one of those there are.
    pub fn ungroup(&mut self, group: GroupNumber) -> Result<(), String> {
        self.groups.retain(|(other, _)| *other != group);
        match self.pager.remove_group(group, self.frame) && !self.pager.remove_group(group, self.frame) {
            true => Ok(()),
            false => Err(format!("frame {}: {group:?} could not be removed, or twice", self.frame)),
        }
    }

    /// Prefetches a region, or pins it.
    pub fn ask(
        &mut self,
        texture: TextureNumber,
        region: &Region,
        urgency: Option<Urgency>,
    ) -> Result<Ticket, AskError> {
        let ticket = match urgency {
            Some(urgency) => self.pager.prefetch(texture, region, urgency),
            None => self.pager.pin(texture, region),
        }?;
        self.log.asked(ticket);
        self.tickets.insert(ticket);
        Ok(ticket)
    }

    /// A view of a texture that there is, of any frame of its path, is expected.
    pub fn expect(&mut self, texture: TextureNumber, at: u64) {
        let Some(member) = self.members.iter().find(|member| member.texture == texture) else { return };
        let view = member.path.view(at);
        let seen = view.feedback(texture, &member.geometry, self.screen, self.frame, false);
        self.pager.expect(&seen);
    }

    /// Lets go of a ticket.
    pub fn release(&mut self, ticket: Ticket) -> Result<(), String> {
        self.pager.release(ticket);
        self.pinned.retain(|(pin, _)| *pin != ticket);
        if self.pager.progress(ticket).is_some() || self.pager.release(ticket) {
            return Err(format!("frame {}: {ticket:?} was released and is open", self.frame));
        }
        self.note_ended()
    }

    /// The content of a part of a texture changes.
    pub fn change(&mut self, texture: TextureNumber, region: &Region) {
        let Some(member) = self.members.iter().find(|member| member.texture == texture) else { return };
        for pos in region.pages(&member.geometry, Reach::Tile) {
            let page = page_id(texture, &member.geometry, pos);
            page.into_iter().for_each(|page| self.contents.change(page));
        }
        let changed = self.pager.invalidate(texture, region);
        self.log.line(format_args!("texture {} changed {changed} pages", texture.number()));
    }

    /// Gives a pool so many slots, and looks whether every tile that stays is moved, and pins are among them.
    /// Returns true if the pool took them.
    pub fn resize(&mut self, pool: PoolId, slots: u32) -> Result<bool, String> {
        let before: Vec<_> = self.pager.pool(pool).resident().collect();
        let mut moves = Vec::new();
        if self.pager.resize_pool(pool, slots, &mut moves).is_err() {
            return Ok(false);
        }
        self.log.moved(pool, slots, &moves);
        let to: BTreeMap<Slot, Slot> = moves.iter().map(|m| (m.from, m.to)).collect();
        let is_where_it_was_moved = |&(page, slot): &(PageId, Slot)| match self.pager.state(page) {
            PageState::Resident(now) => now.index() < slots && to.get(&slot) == Some(&now),
            _ => true,
        };
        if to.len() < moves.len() || !before.iter().all(is_where_it_was_moved) {
            return Err(format!("frame {}: the moves do not say what is in {pool:?}", self.frame));
        }
        self.contents.move_tiles(pool, &moves);
        let mut changes = Vec::new();
        for Member { texture, geometry, table, .. } in self.members.iter_mut().filter(|m| m.pool == pool) {
            let pager = self.pager.pool(pool);
            let tail = pager.tail_slot(*texture).ok_or("a tail has lost its slot")?;
            *table = TableImage::new(geometry, tail);
            pager.resident_changes(*texture, &mut changes);
            changes.iter().for_each(|change| {
                table.apply(geometry, change);
            });
        }
        self.check_pins()?;
        Ok(true)
    }

    /// The device is lost, and with it every pool; the tails are put into the new pools, and page tables
    /// begin anew.
    pub fn lose_device(&mut self) {
        self.pager.tiles_lost();
        self.log.line(format_args!("device lost"));
        self.contents.lose();
        self.pinned.clear(); // they are not all here any more, and that they are is not said again
        for Member { texture, pool, geometry, table, .. } in &mut self.members {
            let Some(slot) = self.pager.pool(*pool).tail_slot(*texture) else { continue };
            *table = TableImage::new(geometry, slot);
            let tail = page_id(*texture, geometry, geometry.tail_pos());
            tail.into_iter().for_each(|tail| self.contents.show_as_it_is(*pool, slot, tail));
        }
    }

    /// Returns true if every resident page is shown as its content is now.
    pub fn is_up_to_date(&self) -> bool {
        self.pager.pools().all(|pager| {
            let mut resident = pager.resident();
            resident.all(|(page, slot)| self.contents.is_shown_as_it_is(pager.pool(), slot, page))
        })
    }

    /// The groups there are.
    pub fn groups(&self) -> impl Iterator<Item = GroupNumber> + '_ {
        self.groups.iter().map(|(group, _)| *group)
    }

    /// The textures there are.
    pub fn textures(&self) -> impl Iterator<Item = TextureNumber> + '_ {
        self.members.iter().map(|member| member.texture)
    }

    /// Holds every camera where it is.
    pub fn hold(&mut self) {
        self.held = self.held.or(Some(self.frame));
    }

    /// Loads under way.
    pub fn loads_under_way(&self) -> usize {
        self.loads.under_way()
    }

    /// Plays one frame.
    pub fn step(&mut self) -> Result<(), String> {
        self.frame += 1;
        self.log.frame(self.frame);
        self.pager.begin_frame(self.frame);
        self.note_ended()?;
        self.see();
        self.observe();
        self.pager.feedback_under_way(self.in_view.front().map(|feedback| feedback.frame));
        self.load()?;
        self.check_in_flight()?;
        self.upload()?;
        self.pager.pools().for_each(|pager| self.log.bias(pager.pool(), pager.bias_eighths()));
        while let Some(event) = self.pager.poll_event() {
            self.log.event(&event);
            self.events.push((self.frame, event));
        }
        self.members.iter().try_for_each(|member| self.check_table(member))?;
        self.check_pins()?;
        self.check_owners()
    }

    /// Takes note of tickets that have ended, each once, and of pins that are all here.
    fn note_ended(&mut self) -> Result<(), String> {
        while let Some((ticket, progress)) = self.pager.poll_ended() {
            self.log.ended(ticket, &progress);
            let all_here = progress.resident + progress.failed == progress.pages;
            if !self.tickets.remove(&ticket) || (progress.state == TicketState::Done) != all_here {
                return Err(format!("frame {}: {ticket:?} ended twice or wrongly: {progress:?}", self.frame));
            }
            let pages = self.pager.pages_of_pin(ticket);
            let here =
                pages.into_iter().filter(|&page| matches!(self.pager.state(page), PageState::Resident(_)));
            self.pinned.push((ticket, here.collect()));
            self.ended.push((ticket, progress));
        }
        Ok(())
    }

    fn load(&mut self) -> Result<(), String> {
        let mut arrivals = self.loads.arrivals(self.frame);
        if !arrivals.is_empty() {
            // Results come in any order.
            let first = self.random.below(arrivals.len() as u64) as usize;
            arrivals.rotate_left(first);
        }
        for (page, outcome) in arrivals {
            self.log.arrived(page, outcome);
            let tile = self.contents.load_ended(page);
            match outcome {
                Outcome::Tile => self.pager.tile_ready(page, tile),
                Outcome::Failure => self.pager.tile_failed(page, "simulated"),
                Outcome::Cancelled => self.pager.tile_cancelled(page),
            }
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.log.cancel(page);
            self.loads.cancel(page);
        }
        while let Some(request) = self.pager.poll_rerank() {
            self.loads.rerank(request.page, request.rank);
            self.log.rerank(request.page, &self.loads);
        }
        while let Some(request) = self.pager.poll_request() {
            if self.loads.has(request.page) {
                return Err(format!("frame {}: {:?} is being loaded already", self.frame, request.page));
            }
            let pool = self.pager.pool(self.pager.pool_of(request.page.texture()).unwrap_or_default());
            self.contents.read(request.page, pool).map_err(|why| format!("frame {}: {why}", self.frame))?;
            self.loads.request(request.page, request.rank);
            self.log.request(request.page, &self.loads);
        }
        self.begin_loads()
    }

    /// No page in view, in whichever pool, waits for one that is not.
    fn begin_loads(&mut self) -> Result<(), String> {
        let begun = self.loads.begin(self.frame);
        begun.iter().for_each(|page| self.log.begun(*page));
        let is_in_view = |page: &PageId| {
            let pool = self.pager.pool_of(page.texture());
            pool.is_some_and(|pool| self.pager.pool(pool).is_for_view(*page))
        };
        let ahead = begun.iter().find(|page| !is_in_view(page));
        match ahead.and_then(|ahead| Some((ahead, self.loads.waiting().find(is_in_view)?))) {
            Some((ahead, waits)) => {
                Err(format!("frame {}: {waits:?} is in view and waits for {ahead:?}", self.frame))
            }
            None => Ok(()),
        }
    }

    fn upload(&mut self) -> Result<(), String> {
        let mut bytes = 0;
        while let Some((pool, upload)) = self.pager.poll_upload() {
            bytes += self.pager.pool(pool).tile_bytes();
            self.log.upload(pool, &upload);
            self.contents.show(pool, upload.slot, &upload.bytes);
            if let Some(evicted) = upload.evicted {
                self.check_eviction(evicted)?;
            }
        }
        self.uploaded.push(bytes);
        self.check_upload_budget()?;
        self.pager.take_table_changes(&mut self.changes);
        self.log.table_changes(&self.changes);
        for Member { texture, geometry, table, .. } in &mut self.members {
            let own = self.changes.iter().filter(|change| change.page.texture() == *texture);
            own.for_each(|change| {
                table.apply(geometry, change);
            });
        }
        Ok(())
    }
}
