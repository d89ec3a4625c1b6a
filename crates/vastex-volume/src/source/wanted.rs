//! Which bricks of levels that are not stored are made, where only those are that somebody wants.

use std::sync::{Mutex, PoisonError};

use rustc_hash::FxHashSet;
use vastex_core::PagePos;

use super::VolumeSource;

/// Pages that are remembered; where more are wanted, those before are made anew when they are read again.
const MOST_PAGES: usize = 1 << 16;

/// Pages that are wanted as they are.
#[derive(Default)]
pub(super) struct Wanted(Mutex<FxHashSet<PagePos>>);

impl Wanted {
    pub(super) fn has(&self, pos: PagePos) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).contains(&pos)
    }

    fn add(&self, pos: PagePos) {
        let mut pages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if pages.len() >= MOST_PAGES {
            pages.clear();
        }
        pages.insert(pos);
    }
}

impl VolumeSource {
    /// Returns true if levels that are not stored may have to be made by [`VolumeSource::make_levels`]. False
    /// where all levels are stored or were made at opening.
    pub fn may_lack_levels(&self) -> bool {
        !self.made.is_whole()
    }

    /// Returns true if bricks of levels that are not stored stay a preview until they are wanted
    /// ([`VolumeSource::want`]).
    pub fn waits_for_want(&self) -> bool {
        self.may_lack_levels() && !self.options.makes_all
    }

    /// Has the brick of a page made where it was, or will be, read as a preview
    /// ([`VolumeOptions::makes_all`](super::VolumeOptions::makes_all)): where that takes little, by whoever
    /// reads it again, else by [`VolumeSource::make_levels`]; [`VolumeSource::take_changes`] says when it is
    /// to be read again. Returns true if anything is new for either of them. Costs a look at up to 27 bricks.
    pub fn want(&self, pos: PagePos) -> bool {
        let geometry = &self.description.geometry;
        if !self.waits_for_want() || !geometry.contains(pos) {
            return false;
        }
        self.wanted.add(pos);
        let mut is_new = false;
        for (level, level_box, _) in geometry.tile_boxes(pos).filter(|(level, ..)| *level >= self.first_made)
        {
            let coords = if geometry.is_tail(pos) { [0; 3] } else { pos.coords() };
            let of = self.levels.level(level);
            let first = of.first_voxel(coords);
            is_new |= self.made.want((level - self.first_made).into(), first, level_box.size);
        }
        is_new
    }
}
