//! Tiles that fade in, where [`Settings::fade`](crate::Settings::fade) says so: which do, and how time passes
//! for them.
//!
//! A tile fades in when it is uploaded for a page that comes into the page table with it; what was on screen
//! before is what the page above it shows, so that nothing is kept for it. Any other tile shows at once: one
//! that takes the place of its page's old one, since what was there is gone, and one that was in a slot
//! already when a page of the same content came, since other pages show it.

use std::collections::HashSet;
use std::time::Duration;

use vastex_core::{ChangeRule, PoolId, Slot, TableChange};
use vastex_wgpu::Fades;

use super::Gpu;

/// What a frame takes unless something else is said.
const FRAME_TIME: Duration = Duration::from_nanos(1_000_000_000 / 60);

/// What is known of a frame.
#[derive(Debug)]
pub(super) struct FadeState {
    frame_time: Duration,
    /// The slots that tiles of this frame went into.
    uploaded: HashSet<(PoolId, Slot)>,
}

impl Default for FadeState {
    fn default() -> FadeState {
        FadeState { frame_time: FRAME_TIME, uploaded: HashSet::new() }
    }
}

impl Gpu {
    pub(crate) fn set_frame_time(&mut self, time: Duration) {
        self.fades.frame_time = time;
    }

    /// Lets the time of a frame pass, before tiles come.
    pub(crate) fn pass_fades(&mut self) {
        let time = self.fades.frame_time;
        self.pools.iter_mut().filter_map(|pool| pool.fades_mut()).for_each(|fades| fades.pass(time));
        self.fades.uploaded.clear();
    }

    /// There is another tile in a slot.
    pub(super) fn note_fade(&mut self, pool: PoolId, slot: Slot) {
        if let Some(fades) = self.fades_of(pool) {
            fades.end(slot);
            self.fades.uploaded.insert((pool, slot));
        }
    }

    /// Pages come into the page tables.
    pub(super) fn begin_fades(&mut self, changes: &[TableChange]) {
        if !self.fades.uploaded.is_empty() {
            for TableChange { page, entry, .. } in
                changes.iter().filter(|change| change.rule == ChangeRule::Coarser)
            {
                let time = self.fade;
                let Some(pool) = self.texture(page.texture()).map(|state| state.pool) else { continue };
                let is_new = self.fades.uploaded.contains(&(pool, entry.slot()));
                if let Some(fades) = self.fades_of(pool).filter(|_| is_new) {
                    fades.begin(entry.slot(), time);
                }
            }
        }
    }

    /// Tells the GPU what has changed.
    pub(super) fn send_fades(&mut self) {
        for fades in self.pools.iter_mut().filter_map(|pool| pool.fades_mut()) {
            fades.send(&self.queue);
        }
    }

    fn fades_of(&mut self, pool: PoolId) -> Option<&mut Fades> {
        self.pools.get_mut(usize::from(pool.number()))?.fades_mut()
    }

    /// Tiles that fade in at the moment.
    pub(crate) fn fading(&self) -> usize {
        let fades = self.pools.iter().filter_map(|pool| pool.gpu()?.fades());
        fades.map(Fades::fading).sum()
    }
}
