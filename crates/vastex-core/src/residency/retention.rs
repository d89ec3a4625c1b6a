//! How long a page that is out of view is worth its slot: Vastex's own rule, for the pager and for replays.
//!
//! - [`Foresight`] says when the moving view may come back to a page.
//! - Views return to where they began, which recent history cannot predict. So of the slots that the view
//!   does not need, [`RESERVE`] stay with the pages that left it first: they give way only to what is
//!   expected back within [`RESERVE_BACK`] frames.

use std::cmp::Ordering;

use crate::residency::foresight::Foresight;
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;

/// Share of the slots out of view that is kept for the pages that left first.
const RESERVE: f64 = 0.3;
/// What is expected back within so many frames is not given up for these.
const RESERVE_BACK: f64 = 24.0;

/// How long a page that is out of view is worth its slot.
#[derive(Clone, Debug)]
pub(crate) struct Retention {
    foresight: Foresight,
    /// Pages out of view for at least so many rounds are the reserve.
    reserve_age: u64,
    /// Reused between frames to avoid allocating.
    ages: Vec<u64>,
}

impl Default for Retention {
    fn default() -> Retention {
        Retention { foresight: Foresight::default(), reserve_age: u64::MAX, ages: Vec::new() }
    }
}

impl Retention {
    /// Takes in the pages wanted now, ancestors included; `cut` where the view has jumped. Costs a visit of
    /// each.
    pub(crate) fn observe(&mut self, pages: impl Iterator<Item = PageId>, cut: bool, textures: &Textures) {
        self.foresight.observe(pages, cut, textures);
    }

    /// Forgets a texture whose number may be given to another.
    pub(crate) fn forget(&mut self, texture: TextureNumber) {
        self.foresight.forget(texture);
    }

    /// Works out which pages are the reserve, from the ages of all that are resident and out of view, and the
    /// slots that the view does not need. Costs a visit of each.
    pub(crate) fn size_reserve(&mut self, ages: impl Iterator<Item = u64>, spare_slots: usize) {
        self.ages.clear();
        self.ages.extend(ages);
        let slots = (RESERVE * spare_slots as f64) as usize;
        self.reserve_age = if slots == 0 || self.ages.is_empty() {
            u64::MAX
        } else {
            let at = self.ages.len().saturating_sub(slots);
            *self.ages.select_nth_unstable(at).1
        };
    }

    /// The reuse distance: frames until a page last wanted `age` rounds ago is thought to be wanted again. A
    /// round is a decision on new feedback, which is about a frame. The page with the most goes first.
    pub(crate) fn reuse_distance(&self, page: PageId, age: u64, textures: &Textures) -> f64 {
        if age >= self.reserve_age {
            return RESERVE_BACK;
        }
        self.foresight.frames_until(page, age, textures)
    }

    /// Returns true if the view stands, as far as can be told.
    pub(crate) fn is_still(&self) -> bool {
        self.foresight.is_still()
    }
}

/// A page that may be evicted, greater where it goes sooner: the latest, among equals the finest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate<P> {
    reuse_distance: f64,
    level: u8,
    page: P,
}

impl<P: Copy> Candidate<P> {
    /// A page of this level that is thought to be wanted again after so long.
    pub(crate) fn new(reuse_distance: f64, level: u8, page: P) -> Candidate<P> {
        Candidate { reuse_distance, level, page }
    }

    pub(crate) fn page(&self) -> P {
        self.page
    }
}

impl<P: Ord> Ord for Candidate<P> {
    fn cmp(&self, other: &Candidate<P>) -> Ordering {
        let by_reuse_distance = self.reuse_distance.total_cmp(&other.reuse_distance);
        by_reuse_distance.then(other.level.cmp(&self.level)).then_with(|| other.page.cmp(&self.page))
    }
}

impl<P: Ord> PartialOrd for Candidate<P> {
    fn partial_cmp(&self, other: &Candidate<P>) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<P: Ord> PartialEq for Candidate<P> {
    fn eq(&self, other: &Candidate<P>) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<P: Ord> Eq for Candidate<P> {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::{Geometry, GeometrySpec};
    use crate::texture::page::{Dims, PagePos};
    use std::sync::Arc;

    const TEXTURE: TextureNumber = TextureNumber::new(0).unwrap();

    fn page(x: u32, y: u32) -> PageId {
        PageId::new(TEXTURE, Dims::D2, PagePos::new_2d(0, x, y)).unwrap()
    }

    /// What a view of 4x4 pages at `x` of row 20 on wants.
    fn view(x: u32) -> impl Iterator<Item = PageId> {
        (20..24).flat_map(move |y| (x..x + 4).map(move |x| page(x, y)))
    }

    fn flown(frames: u32) -> (Retention, Textures) {
        let mut textures = Textures::default();
        textures.add(TEXTURE, Arc::new(Geometry::new(GeometrySpec::image(32768, 16384)).unwrap()), None);
        let mut retention = Retention::default();
        (0..frames).for_each(|frame| retention.observe(view(20 + frame), frame == 0, &textures));
        (retention, textures)
    }

    #[test]
    fn what_the_view_approaches_is_back_before_what_it_passes_and_that_before_what_it_left() {
        let (retention, textures) = flown(32); // to columns 51 to 54
        let late = |x, y| retention.reuse_distance(page(x, y), 5, &textures);
        assert!(!retention.is_still());
        assert_eq!(late(52, 21).round(), 0.0, "in view");
        assert!(late(55, 21) < late(60, 21), "{} {}", late(55, 21), late(60, 21));
        assert!(late(60, 21) < late(52, 26), "{} {}", late(60, 21), late(52, 26));
        assert!(late(52, 26) < late(49, 21), "{} {}", late(52, 26), late(49, 21));
        assert!(late(49, 21) < late(40, 21), "{} {}", late(49, 21), late(40, 21));
    }

    #[test]
    fn the_reserve_is_what_left_first_and_yields_to_what_is_back_soon() {
        let (mut retention, textures) = flown(32);
        retention.size_reserve(1..=100, 100);
        assert_eq!(retention.reuse_distance(page(20, 20), 80, &textures), RESERVE_BACK);
        assert!(retention.reuse_distance(page(49, 21), 60, &textures) > RESERVE_BACK);
        assert!(retention.reuse_distance(page(55, 21), 60, &textures) < RESERVE_BACK);
        retention.size_reserve(1..=100, 2);
        assert!(retention.reuse_distance(page(20, 20), 100, &textures) > RESERVE_BACK, "no slot to spare");
    }

    #[test]
    fn a_texture_that_is_gone_leaves_nothing_behind() {
        let (mut retention, textures) = flown(32);
        retention.forget(TEXTURE);
        assert!(retention.is_still());
        assert_eq!(retention.reuse_distance(page(49, 21), 5, &textures), 5.0);
    }
}
