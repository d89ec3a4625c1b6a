//! Walks every structure of a pager, its residency's among them, and panics where an invariant is broken. For
//! tests; not in release builds.

use std::cell::Cell;

use rustc_hash::FxHashMap;

use crate::pager::Pager;
use crate::pager::pool::PoolPager;
use crate::texture::page::PageId;

thread_local! {
    static ARE_PAUSED: Cell<bool> = const { Cell::new(false) };
}

/// Does `work` without checks, on this thread: for a test of what the pager itself costs.
pub fn paused<R>(work: impl FnOnce() -> R) -> R {
    ARE_PAUSED.set(true);
    let result = work();
    ARE_PAUSED.set(false);
    result
}

impl PoolPager {
    /// Called after every step. It costs a visit of every record, so that pagers of thousands are not checked
    /// each time.
    #[expect(clippy::panic, reason = "a broken invariant must stop the test that found it")]
    pub(crate) fn check(&self) {
        if !cfg!(debug_assertions) || ARE_PAUSED.get() {
            return;
        }
        if self.check_pace.is_due(self.residency.known())
            && let Err(broken) = walk(self)
        {
            panic!("an invariant of the pager is broken: {broken}");
        }
    }
}

impl Pager {
    /// Called after every request.
    #[expect(clippy::panic, reason = "a broken invariant must stop the test that found it")]
    pub(crate) fn check_in_flight(&self) {
        if !cfg!(debug_assertions) || ARE_PAUSED.get() {
            return;
        }
        let largest = self.pools().map(|pager| pager.residency.flight_bytes()).max().unwrap_or(0);
        let bytes: u64 = self.pools().map(|pager| pager.residency.stats().in_flight_bytes).sum();
        let allowed = self.budgets.in_flight_bytes.max(largest);
        if bytes > allowed {
            panic!("an invariant of the pager is broken: {bytes} bytes in flight of {allowed} allowed");
        }
    }
}

fn walk(pager: &PoolPager) -> Result<(), String> {
    pager.residency.walk(&pager.textures)?;
    claims_are_counted(pager)?;
    removed_textures_leave_nothing(pager)?;
    working_set_fits(pager)
}

/// What tickets and predictions hold is what the residency knows of.
fn claims_are_counted(pager: &PoolPager) -> Result<(), String> {
    let counted: FxHashMap<PageId, u32> = pager.residency.claims().collect();
    if counted != pager.claims.count() {
        return Err("the claims to pages are miscounted".into());
    }
    Ok(())
}

/// But the loads that the loader has yet to answer, which the residency looks at.
fn removed_textures_leave_nothing(pager: &PoolPager) -> Result<(), String> {
    let is_gone = |page: &PageId| pager.textures.geometry(page.texture()).is_none();
    let claimed = pager.residency.claims().map(|(page, _)| page).chain(pager.claims.pinned());
    let listed = pager.load_order.pages().chain(pager.plan.pages());
    match listed.chain(claimed).find(is_gone) {
        Some(page) => Err(format!("{page:?} is wanted, but its texture was removed")),
        None => Ok(()),
    }
}

fn working_set_fits(pager: &PoolPager) -> Result<(), String> {
    let (stats, residency) = (pager.stats(), &pager.residency);
    // Textures added since the last feedback are not yet solved for.
    let solved = stats.wanted_at_bias - stats.tails + residency.tails_at_round();
    let share = (u64::from(stats.slots) * 90 / 100) as u32;
    if pager.bias.is_solved() && residency.has_round() && solved > share.max(residency.tails_at_round()) {
        return Err(format!("the working set does not fit: {stats:?}"));
    }
    Ok(())
}
