//! Walks every structure of the pager and panics where an invariant is broken. For tests; not in release builds.

use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};

use rustc_hash::FxHashMap;

use crate::pager::bias::BiasRule;
use crate::pager::pool::Pager;
use crate::residency::Residency;
use crate::residency::records::{Record, State};
use crate::table::pool::Slot;
use crate::texture::page::PageId;

/// Records that a step visits for its checks, on average, at most: a pager of more is checked after some steps only.
const VISITS: usize = 256;

thread_local! {
    static ARE_PAUSED: Cell<bool> = const { Cell::new(false) };
}

/// Visits that a pager's steps without a check have left to a later one. Each pager has its own, so that none uses up those of others.
#[derive(Debug, Default)]
pub(crate) struct Savings(AtomicUsize);

impl Savings {
    /// Whether, after another step, a check of so many visits is due.
    fn is_due(&self, visits: usize) -> bool {
        let saved = self.0.load(Ordering::Relaxed) + VISITS;
        let is_due = saved >= visits;
        self.0.store(if is_due { 0 } else { saved }, Ordering::Relaxed);
        is_due
    }
}

/// Does `work` without checks, on this thread: for a test of what the pager itself costs.
pub fn paused<R>(work: impl FnOnce() -> R) -> R {
    ARE_PAUSED.set(true);
    let result = work();
    ARE_PAUSED.set(false);
    result
}

/// Called after every step. It costs a visit of every record, so that pagers of thousands are not checked each time.
#[expect(clippy::panic, reason = "a broken invariant must stop the test that found it")]
pub(crate) fn check(pager: &Pager) {
    if !cfg!(debug_assertions) || ARE_PAUSED.get() {
        return;
    }
    if pager.savings.is_due(pager.residency.records.len())
        && let Err(broken) = walk(pager)
    {
        panic!("an invariant of the pager is broken: {broken}");
    }
}

fn walk(pager: &Pager) -> Result<(), String> {
    slots_and_records_agree(pager)?;
    contents_are_loaded_once(pager)?;
    flight_is_counted(pager)?;
    removed_textures_leave_nothing(pager)?;
    ancestors_stay(pager)?;
    working_set_fits(pager)
}

fn slots_and_records_agree(pager: &Pager) -> Result<(), String> {
    let residency = &pager.residency;
    let (stats, mut pages) = (&residency.stats, vec![0; residency.slots.len()]);
    pager.resident().for_each(|(_, slot)| pages[slot.index() as usize] += 1);
    for (slot, (holding, &pages)) in residency.slots.iter().zip(&pages).enumerate() {
        let content = residency.sharing.get(holding.content);
        if holding.pages != pages || pages > 1 && content.is_none() {
            return Err(format!("slot {slot} has {pages} pages: {holding:?}"));
        }
        if content.is_some_and(|content| content.slot != Some(Slot::new(slot as u32))) {
            return Err(format!("slot {slot} holds a content that is elsewhere: {holding:?}, {content:?}"));
        }
    }
    let (resident, occupied) = (pages.iter().sum::<u32>(), pages.iter().filter(|&&pages| pages > 0).count());
    if resident != stats.resident || occupied as u32 != stats.occupied {
        return Err(format!("{resident} pages are resident, {occupied} slots occupied: {stats:?}"));
    }
    if occupied + residency.free.len() != residency.slots.len() {
        return Err(format!("{occupied} slots occupied, {} free", residency.free.len()));
    }
    if let Some(slot) = residency.free.iter().find(|slot| pages[slot.index() as usize] > 0) {
        return Err(format!("{slot:?} is free and holds pages"));
    }
    if let Some(tail) = pager.textures.tails().find(|&tail| residency.slot_of(tail).is_none()) {
        return Err(format!("tail {tail:?} has lost its slot"));
    }
    Ok(())
}

/// A content is in one slot, or on its way by one page, or neither; a resident page shows its content, or waits to be refreshed.
fn contents_are_loaded_once(pager: &Pager) -> Result<(), String> {
    let Residency { sharing, slots, refreshes, records, .. } = &pager.residency;
    for (id, content) in sharing.iter() {
        let at = content.slot.map(|slot| slots[slot.index() as usize].content);
        if at.is_some_and(|at| at != id) || at.is_some() && content.carrier != PageId::NONE {
            return Err(format!("{id:?} is not where it should be, or loaded again: {content:?}"));
        }
        let carrier = records.get(content.carrier);
        if content.carrier != PageId::NONE && (carrier.is_none() || sharing.of(content.carrier) != id) {
            return Err(format!("{id:?} is carried by a page that knows nothing of it: {content:?}"));
        }
    }
    for record in records.iter() {
        let (page, id) = (record.page, sharing.of(record.page));
        let content = sharing.get(id);
        let is_fine = match record.state {
            State::Resident(slot) => {
                slots[slot.index() as usize].content == id || refreshes.pages().any(|other| other == page)
            }
            State::Loading(_) | State::Ready => content.is_none_or(|content| content.carrier == page),
            State::Absent | State::Queued | State::Failed => true,
        };
        if !is_fine {
            return Err(format!("{record:?} has {id:?}: {content:?}"));
        }
    }
    Ok(())
}

/// But the loads that the loader has yet to answer.
fn removed_textures_leave_nothing(pager: &Pager) -> Result<(), String> {
    let residency = &pager.residency;
    let is_gone = |page: &&PageId| pager.textures.geometry(page.texture()).is_none();
    let is_loading = |record: &Record| matches!(record.state, State::Loading(_));
    let mut gone = residency.records.iter().filter(|record| is_gone(&&record.page));
    if let Some(record) = gone.find(|record| !is_loading(record)) {
        return Err(format!("{:?} has a state, but its texture was removed", record.page));
    }
    let asked_for =
        residency.tickets.held().chain(residency.tickets.pinned()).chain(residency.expected.pages());
    let listed = pager.order.iter().chain(&pager.by_hand).copied();
    match listed.chain(asked_for).chain(residency.refreshes.pages()).find(|page| is_gone(&page)) {
        Some(page) => Err(format!("{page:?} is wanted, but its texture was removed")),
        None => Ok(()),
    }
}

fn flight_is_counted(pager: &Pager) -> Result<(), String> {
    let (settings, stats) = (&pager.settings, &pager.residency.stats);
    let in_flight = |state: &State| matches!(state, State::Loading(_) | State::Ready);
    let first_loads = pager.residency.records.iter().filter(|record| in_flight(&record.state)).count();
    let count = (first_loads + pager.residency.refreshes.in_flight()) as u64;
    let flight_bytes = pager.residency.flight_bytes;
    let bytes = count * flight_bytes;
    if !pager.residency.refreshes.ready_are_counted() {
        return Err("the new tiles that wait are miscounted".into());
    }
    if count != u64::from(stats.in_flight) || bytes != stats.in_flight_bytes {
        return Err(format!("{count} tiles are in flight: {stats:?}"));
    }
    let (of_textures, for_view) = pager.residency.flight.totals();
    if of_textures != stats.in_flight {
        return Err(format!("the textures have {of_textures} tiles in flight: {stats:?}"));
    }
    let mut counted = 0;
    for record in pager.residency.records.iter().filter(|record| record.for_view) {
        counted += 1;
        if !in_flight(&record.state) {
            return Err(format!("{record:?} is not in flight"));
        }
    }
    if counted != for_view {
        return Err(format!("{counted} tiles are in flight for the view, not {for_view}: {stats:?}"));
    }
    if bytes > settings.in_flight_bytes.max(flight_bytes) {
        return Err(format!("{bytes} bytes in flight of {} allowed", settings.in_flight_bytes));
    }
    Ok(())
}

fn ancestors_stay(pager: &Pager) -> Result<(), String> {
    let mut below: FxHashMap<PageId, u32> = FxHashMap::default();
    for (page, _) in pager.resident() {
        for ancestor in pager.textures.ancestors(page) {
            *below.entry(ancestor).or_default() += 1;
        }
    }
    let counted = pager.residency.records.iter().filter(|record| record.below > 0);
    if below != counted.map(|record| (record.page, record.below)).collect() {
        return Err("the counts of resident descendants are off".into());
    }
    let says_nothing = |record: &&Record| record.state == State::Absent && record.below == 0;
    match pager.residency.records.iter().find(says_nothing) {
        Some(record) => Err(format!("{:?} has a record for nothing", record.page)),
        None => Ok(()),
    }
}

fn working_set_fits(pager: &Pager) -> Result<(), String> {
    let (stats, residency) = (pager.stats(), &pager.residency);
    // Textures added since the last feedback are not yet solved for.
    let solved = stats.wanted_at_bias - stats.pinned + residency.pinned_at_round;
    let share = (u64::from(stats.slots) * 90 / 100) as u32;
    let is_solved = pager.settings.mip_bias == Some(BiasRule::Solved);
    if is_solved && residency.round > 1 && solved > share.max(residency.pinned_at_round) {
        return Err(format!("the working set does not fit: {stats:?}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_pager_is_checked_beside_small_ones() {
        let [small, large] = [(); 2].map(|()| Savings::default());
        let checked = (0..100).filter(|_| {
            assert!(small.is_due(VISITS) && small.is_due(1));
            large.is_due(10 * VISITS)
        });
        assert_eq!(checked.count(), 10);
    }
}
