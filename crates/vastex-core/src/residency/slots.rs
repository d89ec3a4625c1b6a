//! Slots, and the pages in them: one, or all resident pages of one content.
//!
//! | a page | is in the slot of its content | else |
//! |---|---|---|
//! | comes into view, or is to be held, and its content is in a slot | joins it at once: a page-table change, no load, no upload | the best page of the content becomes its representative, the others wait |
//! | is out of view, and more pages share than there are slots | leaves it, some in each frame, so that memory follows the pool | |
//! | is evicted | leaves it; the slot is free when the last has left | |
//! | changes its content (`refresh`) | stays in it as a *stale sharer* until its new tile is here, which then goes into a slot of its own; out of view it is let go of | |
//!
//! Which page is evicted is `victims`' business, what contents there are `sharing`'s.

use rustc_hash::FxHashMap;

use crate::residency::Residency;
use crate::residency::records::{Record, RecordHint, State};
use crate::residency::sharing::ContentId;
use crate::residency::stats::Stats;
use crate::table::pool::Slot;
use crate::texture::page::PageId;
use crate::texture::textures::Textures;

/// Pages that share and are let go of in a frame at most, and parts of the records that take turns in being
/// looked at for them.
const TRIMMED: u32 = 64;
const TRIM_PARTS: usize = 8;

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SlotUse {
    /// Resident pages whose table entries name the slot; none where it is free.
    pub(super) pages: u32,
    /// What all of them have, but for stale sharers; none where it is that of one page alone.
    pub(super) content: ContentId,
}

impl SlotUse {
    pub(crate) const FREE: SlotUse = SlotUse { pages: 0, content: ContentId::NONE };
}

impl Residency {
    pub(crate) fn slot_use(&mut self, slot: Slot) -> &mut SlotUse {
        &mut self.slots[slot.index() as usize]
    }

    /// A tile goes into an empty slot, for a page.
    pub(crate) fn put_in(&mut self, slot: Slot, content: ContentId) {
        *self.slot_use(slot) = SlotUse { pages: 1, content };
        self.stats.occupied += 1;
        self.stats.resident += 1;
        if let Some(content) = self.sharing.get_mut(content) {
            content.slot = Some(slot);
        }
    }

    /// A page leaves its slot. Returns true if that is free now.
    pub(crate) fn take_out(&mut self, slot: Slot) -> bool {
        let slot_use = self.slot_use(slot);
        slot_use.pages -= 1;
        let content = slot_use.content;
        let is_free = slot_use.pages == 0;
        self.stats.resident -= 1;
        if is_free {
            *self.slot_use(slot) = SlotUse::FREE;
            self.stats.occupied -= 1;
            if let Some(content) = self.sharing.get_mut(content) {
                content.slot = None;
            }
        }
        is_free
    }

    /// A slot for a tile that is ready, and the last page that gave it up; `None` if no page may be evicted.
    /// A shared slot is free when all its pages are evicted. Pages whose slot still has other sharers may be
    /// evicted too without freeing it; they come back without a load.
    pub(crate) fn take_slot(&mut self, textures: &Textures) -> Option<(Slot, Option<PageId>)> {
        if let Some(slot) = self.free.pop() {
            return Some((slot, None));
        }
        let (slot, victim) = self.evict_next(textures)?;
        Some((slot, Some(victim)))
    }

    /// Evicts what goes next until a slot is free; `None` if none may. Says which page was the last.
    pub(crate) fn evict_next(&mut self, textures: &Textures) -> Option<(Slot, PageId)> {
        loop {
            let victim = self.next_victim(textures)?;
            let slot = self.slot_of(victim)?;
            if self.evict(victim, slot, textures) {
                return Some((slot, victim));
            }
        }
    }

    /// Returns true if the slot is free now.
    pub(crate) fn evict(&mut self, page: PageId, slot: Slot, textures: &Textures) -> bool {
        let content = self.slot_use(slot).content;
        let is_free = self.take_out(slot);
        self.moves.evicted.push((page, slot));
        self.last_evicted = self.frame;
        if let Some(record) = self.records.get(page).filter(|_| !content.is_some()) {
            self.rest.note_evicted(record);
        }
        self.records.remove(page);
        self.refreshes.evicted(page);
        for ancestor in textures.ancestors(page) {
            let Some(record) = self.records.get_mut(ancestor) else { continue };
            record.below -= 1;
            if record.below == 0 {
                let record = *record;
                if record.state == State::Absent {
                    self.drop_page(ancestor);
                }
                self.note_last_descendant_gone(&record, textures);
            }
        }
        if is_free {
            self.stats.evicted += 1;
            if let Some(content) = self.sharing.get_mut(content) {
                content.evicted_at = Some(self.frame);
            } else {
                self.evicted_at.insert(page, self.frame);
                self.evictions.push_back((self.frame, page));
            }
        }
        is_free
    }

    /// Returns true if a page that is queued is to be asked for: its content is neither here nor under way.
    pub(crate) fn may_load(&self, page: PageId) -> bool {
        let content = self.sharing.get(self.sharing.of(page));
        content.is_none_or(|content| {
            content.slot.is_none()
                && (content.representative == page || content.representative == PageId::NONE)
        })
    }

    /// The page becomes resident where its content is in a slot already. Returns true if it has.
    pub(crate) fn join(&mut self, page: PageId, textures: &Textures) -> bool {
        let Some(slot) = self.sharing.content_of(page).and_then(|content| content.slot) else { return false };
        let state = self.records.get_or_add(page, RecordHint::default()).state;
        if matches!(state, State::Absent | State::Queued | State::Failed) {
            self.slot_use(slot).pages += 1;
            self.stats.resident += 1;
            self.stats.shared += 1;
            self.become_resident(page, slot, textures);
            self.moves.settled.push(page);
        }
        true
    }

    /// Which page is loaded for one that is missing in view and comes next in the order: itself, or its
    /// content's representative; none where its content is here, and it with it, or is listed already.
    pub(crate) fn load_for(&mut self, page: PageId, textures: &Textures) -> Option<PageId> {
        if self.join(page, textures) {
            return None;
        }
        let (round, frame) = (self.round, self.frame);
        let Some(content) = self.sharing.content_of(page) else { return Some(page) };
        if content.listed_round == round {
            return None;
        }
        content.listed_round = round;
        let representative = self.representative_for(page);
        if representative != page {
            self.records.get_or_add(representative, RecordHint::default()).use_for(frame);
        }
        Some(representative)
    }

    /// The representative of the page's content, or the page where there is none. What the source of one
    /// texture cannot give that of another may.
    fn representative_for(&mut self, page: PageId) -> PageId {
        let Some(representative) = self.sharing.representative_of(page) else { return page };
        let has_failed = self.records.get(representative).is_none_or(|record| record.state == State::Failed);
        if has_failed && representative.texture() != page.texture() {
            self.sharing.release_representative(representative);
            return page;
        }
        representative
    }

    /// The same for a page that is to be held, in a plan of what comes after the view.
    pub(crate) fn load_after_view_for(&mut self, page: PageId, textures: &Textures) -> Option<PageId> {
        if self.join(page, textures) {
            return None;
        }
        let (round, plan) = (self.round, self.sharing.plan);
        let Some(content) = self.sharing.content_of(page) else { return Some(page) };
        if content.wanted_round >= round || content.planned == plan {
            return None; // it comes with what is in view, or is listed already
        }
        content.planned = plan;
        Some(self.representative_for(page))
    }

    /// Returns true if the content that the page represents has a use, for whichever of its pages.
    pub(crate) fn represents_something_of_use(&self, page: PageId) -> bool {
        let content =
            self.sharing.get(self.sharing.of(page)).filter(|content| content.representative == page);
        content.is_some_and(|content| {
            content.wanted_round >= self.round || content.planned == self.sharing.plan && content.planned > 0
        })
    }

    /// Returns true if the page, which is resident, is in a slot that is not to be written over with what is
    /// its own alone.
    pub(crate) fn is_stale_sharer(&self, page: PageId) -> bool {
        if self.sharing.is_empty() {
            return false;
        }
        let slot_use = self.slot_of(page).map(|slot| self.slots[slot.index() as usize]);
        slot_use.is_some_and(|slot_use| slot_use.pages > 1 && slot_use.content != self.sharing.of(page))
    }

    /// The stale sharers, in no order.
    pub(crate) fn stale_sharers(&self) -> impl Iterator<Item = PageId> + '_ {
        self.refreshes.pages().filter(|&page| self.is_stale_sharer(page))
    }

    /// A page that is alone in its slot is about to write its own tile there.
    pub(crate) fn take_over(&mut self, slot: Slot) {
        let content = std::mem::replace(&mut self.slot_use(slot).content, ContentId::NONE);
        if let Some(content) = self.sharing.get_mut(content) {
            content.slot = None;
        }
    }

    /// Evicts stale sharers out of view: what they show is out of date, and nobody sees it.
    pub(crate) fn evict_stale_sharers(&mut self, textures: &Textures) {
        if self.sharing.is_empty() {
            return;
        }
        let mut stale: Vec<PageId> = self.stale_sharers().collect();
        stale.sort_unstable_by_key(|&page| (page.level(), page)); // descendants first
        for page in stale {
            let may_go = self.records.get(page).and_then(|record| self.age_if_evictable(record)).is_some();
            if let Some(slot) = self.slot_of(page).filter(|_| may_go && self.is_stale_sharer(page)) {
                self.evict(page, slot, textures); // others stay, so the slot is not free
            }
        }
    }

    /// Evicts each of these pages, out of view, with its descendants, held or not, where all of them may go.
    /// Costs one visit of every record for all of them together.
    pub(crate) fn evict_branches(&mut self, roots: &[PageId], textures: &Textures) {
        if roots.is_empty() {
            return;
        }
        // Each with its root's place among the roots, the finest first, so that descendants go before their
        // ancestors.
        let mut branches: Vec<(usize, u8, PageId)> = Vec::new();
        let places: FxHashMap<PageId, usize> = roots.iter().copied().zip(0..).collect();
        let has_descendants = |page: &PageId| self.records.get(*page).is_some_and(|record| record.below > 0);
        if roots.iter().any(has_descendants) {
            let coarsest = roots.iter().map(|root| root.level()).max().unwrap_or(0);
            for record in self.records.iter().filter(|record| matches!(record.state, State::Resident(_))) {
                let line = std::iter::once(record.page).chain(textures.ancestors(record.page));
                let above = line.take_while(|page| page.level() <= coarsest);
                let of_roots = above.filter_map(|page| places.get(&page));
                branches.extend(of_roots.map(|&root| (root, record.page.level(), record.page)));
            }
            branches.sort_unstable();
        } else {
            branches.extend(roots.iter().zip(0..).map(|(&page, root)| (root, page.level(), page)));
        }
        for branch in branches.chunk_by(|a, b| a.0 == b.0) {
            self.evict_branch(branch, textures);
        }
    }

    fn evict_branch(&mut self, branch: &[(usize, u8, PageId)], textures: &Textures) {
        let is_out_of_view = |record: &Record| record.age_out_of_view(self.round).is_some();
        // What has gone with another branch does not count.
        let may_go = |&(_, _, page): &(usize, u8, PageId)| {
            self.records.get(page).is_none_or(|record| {
                let stays = self.is_busy(record) || self.rest.keeps(record);
                !matches!(record.state, State::Resident(_)) || is_out_of_view(record) && !stays
            })
        };
        if !branch.iter().all(may_go) {
            return;
        }
        for &(_, _, page) in branch {
            let Some(slot) = self.slot_of(page) else { continue };
            if self.evict(page, slot, textures) {
                self.free.push(slot);
            }
            self.allow_again(page);
        }
    }

    /// Lets some pages out of view go that share their slots, where they are more than the pool has slots:
    /// they cost a record each, and come back without a load. While views rest only those go that none of
    /// them has wanted.
    pub(crate) fn trim_shared(&mut self, textures: &Textures, at_rest: bool) {
        let Stats { resident, occupied, slots, .. } = self.stats;
        let excess = (resident - occupied).saturating_sub(slots).min(TRIMMED);
        if excess == 0 {
            return;
        }
        let mut pages = std::mem::take(&mut self.sharing.trimmed);
        let part = (self.round % TRIM_PARTS as u64) as usize;
        let shares = |record: &&Record| match record.state {
            State::Resident(slot) => self.slots[slot.index() as usize].pages > 1,
            _ => false,
        };
        let may_go = |record: &&Record| {
            let is_of_use = self.is_claimed(record.page) || at_rest && record.was_wanted;
            self.age_if_evictable(record).is_some() && !is_of_use
        };
        let candidates = self.records.part(part, TRIM_PARTS).filter(shares).filter(may_go);
        pages.extend(candidates.map(|record| record.page).take(excess as usize));
        for page in pages.drain(..) {
            // Of several in a slot the last stays.
            if let Some(slot) = self.slot_of(page).filter(|slot| self.slots[slot.index() as usize].pages > 1)
            {
                self.evict(page, slot, textures);
            }
        }
        self.sharing.trimmed = pages;
    }

    /// A stale sharer moves into a slot of its own; the last in a slot leaves it free.
    pub(crate) fn move_stale_sharer(&mut self, page: PageId, to: Slot) {
        let Some(record) = self.records.get_mut(page) else { return };
        let State::Resident(from) = record.state else { return };
        record.state = State::Resident(to);
        // It is alone by now where the others were evicted so that it got the slot.
        if self.take_out(from) {
            self.free.push(from);
        }
        self.put_in(to, ContentId::NONE);
        self.moves.evicted.push((page, from));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residency::records::VISITED;
    use crate::texture::geometry::{Geometry, GeometrySpec};
    use crate::texture::page::{Dims, PagePos, TextureNumber};
    use std::sync::Arc;

    fn page(level: u8, x: u32, y: u32) -> PageId {
        PageId::new(TextureNumber::new(0).unwrap(), Dims::D2, PagePos::new_2d(level, x, y)).unwrap()
    }

    /// It was a walk for each of them, in every frame in which they found no room.
    #[test]
    fn branches_go_together_in_one_walk_but_for_those_in_view() {
        let (mut textures, mut residency) = (Textures::default(), Residency::new(1400, 1));
        let geometry = Arc::new(Geometry::new(GeometrySpec::image(4096, 4096)).unwrap());
        textures.add(TextureNumber::new(0).unwrap(), geometry, None);
        residency.begin_frame(1);
        residency.begin_round();
        for level in (0..=4u8).rev() {
            let side = 32 >> level;
            for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
                let (slot, _) = residency.take_slot(&textures).unwrap();
                residency.put_in(slot, ContentId::NONE);
                residency.become_resident(page(level, x, y), slot, &textures);
            }
        }
        residency.begin_frame(2);
        residency.begin_round();
        residency.want(page(0, 0, 0), ContentId::NONE, RecordHint::default());
        let before = residency.stats.resident;
        let roots: Vec<PageId> = (0..8).flat_map(|y| (0..8).map(move |x| page(2, x, y))).collect();
        VISITED.set(0);
        residency.evict_branches(&roots, &textures);
        assert!(VISITED.get() <= before as usize + 64, "{} visits of {before} records", VISITED.get());
        assert_eq!(before - residency.stats.resident, 63 * (1 + 4 + 16));
        assert!(
            is_here(&residency, page(2, 0, 0)) && is_here(&residency, page(0, 3, 3)),
            "all of a branch stays"
        );
        assert!(!is_here(&residency, page(2, 1, 0)) && is_here(&residency, page(3, 1, 0)));
        // Without descendants there is nothing to walk for.
        VISITED.set(0);
        residency.evict_branches(&[page(3, 1, 0)], &textures);
        assert_eq!((VISITED.get(), is_here(&residency, page(3, 1, 0))), (0, false));
    }

    fn is_here(residency: &Residency, page: PageId) -> bool {
        residency.slot_of(page).is_some()
    }
}
