//! Walks every structure of a residency and says which invariant is broken. For tests; not in release builds.

use rustc_hash::FxHashMap;

use crate::residency::Residency;
use crate::residency::records::{Record, State};
use crate::table::pool::Slot;
use crate::texture::page::PageId;
use crate::texture::textures::Textures;

impl Residency {
    /// Costs a visit of every record.
    pub(crate) fn walk(&self, textures: &Textures) -> Result<(), String> {
        slots_and_records_agree(self, textures)?;
        contents_are_loaded_once(self)?;
        flight_is_counted(self)?;
        removed_textures_leave_loads(self, textures)?;
        ancestors_stay(self, textures)
    }

    /// Slots that held a tail when the last working set was worked out.
    pub(crate) fn tails_at_round(&self) -> u32 {
        self.tails_at_round
    }

    /// Returns true if a working set was worked out.
    pub(crate) fn has_round(&self) -> bool {
        self.round > 1
    }
}

/// And nothing else: those that the loader has yet to answer.
fn removed_textures_leave_loads(residency: &Residency, textures: &Textures) -> Result<(), String> {
    let is_gone = |page: PageId| textures.geometry(page.texture()).is_none();
    let is_loading = |record: &Record| matches!(record.state, State::Loading(_));
    let mut gone = residency.records.iter().filter(|record| is_gone(record.page));
    if let Some(record) = gone.find(|record| !is_loading(record)) {
        return Err(format!("{:?} has a state, but its texture was removed", record.page));
    }
    match residency.refreshes.pages().find(|&page| is_gone(page)) {
        Some(page) => Err(format!("{page:?} is refreshed, but its texture was removed")),
        None => Ok(()),
    }
}

fn slots_and_records_agree(residency: &Residency, textures: &Textures) -> Result<(), String> {
    let (stats, mut pages) = (&residency.stats, vec![0; residency.slots.len()]);
    residency.resident().for_each(|(_, slot)| pages[slot.index() as usize] += 1);
    for (slot, (slot_use, &pages)) in residency.slots.iter().zip(&pages).enumerate() {
        let content = residency.sharing.get(slot_use.content);
        if slot_use.pages != pages || pages > 1 && content.is_none() {
            return Err(format!("slot {slot} has {pages} pages: {slot_use:?}"));
        }
        if content.is_some_and(|content| content.slot != Some(Slot::new(slot as u32))) {
            return Err(format!("slot {slot} holds a content that is elsewhere: {slot_use:?}, {content:?}"));
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
    if let Some(tail) = textures.tails().find(|&tail| residency.slot_of(tail).is_none()) {
        return Err(format!("tail {tail:?} has lost its slot"));
    }
    Ok(())
}

/// A content is in one slot, or on its way by one page, or neither; a resident page shows its content, or
/// waits to be refreshed.
fn contents_are_loaded_once(residency: &Residency) -> Result<(), String> {
    let Residency { sharing, slots, refreshes, records, .. } = residency;
    for (id, content) in sharing.iter() {
        let at = content.slot.map(|slot| slots[slot.index() as usize].content);
        if at.is_some_and(|at| at != id) || at.is_some() && content.representative != PageId::NONE {
            return Err(format!("{id:?} is not where it should be, or loaded again: {content:?}"));
        }
        let representative = records.get(content.representative);
        if content.representative != PageId::NONE
            && (representative.is_none() || sharing.of(content.representative) != id)
        {
            return Err(format!("{id:?} is represented by a page that knows nothing of it: {content:?}"));
        }
    }
    for record in records.iter() {
        let (page, id) = (record.page, sharing.of(record.page));
        let content = sharing.get(id);
        let is_fine = match record.state {
            State::Resident(slot) => {
                slots[slot.index() as usize].content == id || refreshes.pages().any(|other| other == page)
            }
            State::Loading(_) | State::Ready => content.is_none_or(|content| content.representative == page),
            State::Absent | State::Queued | State::Failed => true,
        };
        if !is_fine {
            return Err(format!("{record:?} has {id:?}: {content:?}"));
        }
    }
    Ok(())
}

fn flight_is_counted(residency: &Residency) -> Result<(), String> {
    let stats = &residency.stats;
    let in_flight = |state: &State| matches!(state, State::Loading(_) | State::Ready);
    let first_loads = residency.records.iter().filter(|record| in_flight(&record.state)).count();
    let count = (first_loads + residency.refreshes.in_flight()) as u64;
    let flight_bytes = residency.flight_bytes;
    let bytes = count * flight_bytes;
    if !residency.refreshes.ready_are_counted() {
        return Err("the new tiles that wait are miscounted".into());
    }
    if count != u64::from(stats.in_flight) || bytes != stats.in_flight_bytes {
        return Err(format!("{count} tiles are in flight: {stats:?}"));
    }
    let (of_textures, for_view) = residency.flight.totals();
    if of_textures != stats.in_flight {
        return Err(format!("the textures have {of_textures} tiles in flight: {stats:?}"));
    }
    let mut counted = 0;
    for record in residency.records.iter().filter(|record| record.for_view) {
        counted += 1;
        if !in_flight(&record.state) {
            return Err(format!("{record:?} is not in flight"));
        }
    }
    if counted != for_view {
        return Err(format!("{counted} tiles are in flight for the view, not {for_view}: {stats:?}"));
    }
    Ok(())
}

fn ancestors_stay(residency: &Residency, textures: &Textures) -> Result<(), String> {
    let mut below: FxHashMap<PageId, u32> = FxHashMap::default();
    for (page, _) in residency.resident() {
        for ancestor in textures.ancestors(page) {
            *below.entry(ancestor).or_default() += 1;
        }
    }
    let counted = residency.records.iter().filter(|record| record.below > 0);
    if below != counted.map(|record| (record.page, record.below)).collect() {
        return Err("the counts of resident descendants are off".into());
    }
    let says_nothing = |record: &&Record| record.state == State::Absent && record.below == 0;
    match residency.records.iter().find(says_nothing) {
        Some(record) => Err(format!("{:?} has a record for nothing", record.page)),
        None => Ok(()),
    }
}
