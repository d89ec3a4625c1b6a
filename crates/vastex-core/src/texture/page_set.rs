//! Which pages of a texture have tiles, where not all have.
//!
//! A texture may leave out what nobody will look at, and may be finer in some places than in others. The
//! pages that are there form a tree that hangs from the tail: with a page all its ancestors are there. So
//! where a page is missing, its nearest ancestor stands in for it, and there always is one.

use crate::texture::geometry::Geometry;
use crate::texture::numbering::PageNumbering;
use crate::texture::page::PagePos;

/// A set of pages of one texture, with their ancestors; the tail is always in it. One bit for each page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageSet {
    numbering: PageNumbering,
    /// A bit for each entry.
    bits: Vec<u64>,
    pages: u64,
}

impl PageSet {
    /// The set of the tail alone.
    pub fn new(geometry: &Geometry) -> PageSet {
        let numbering = PageNumbering::new(geometry);
        PageSet { bits: vec![0; numbering.entries().div_ceil(64) as usize], numbering, pages: 1 }
    }

    /// The pages for which `has_tile` says so and whose ancestors are in the set as well. It is asked from
    /// coarse to fine.
    pub fn from_pages(geometry: &Geometry, has_tile: impl Fn(PagePos) -> bool) -> PageSet {
        let mut set = PageSet::new(geometry);
        for pos in geometry.pages().skip(1) {
            let hangs = geometry.parent(pos).is_some_and(|parent| set.contains(parent));
            if hangs && has_tile(pos) {
                set.set(pos);
            }
        }
        set
    }

    /// Puts a page and its ancestors into the set. The page exists in `geometry`, for which the set was made.
    pub fn insert(&mut self, geometry: &Geometry, pos: PagePos) {
        let mut next = Some(pos);
        while let Some(pos) = next.filter(|&pos| !self.contains(pos)) {
            self.set(pos);
            next = geometry.parent(pos);
        }
    }

    fn set(&mut self, pos: PagePos) {
        if let Some((word, bit)) = self.bit(pos) {
            self.pages += u64::from(self.bits[word] & bit == 0);
            self.bits[word] |= bit;
        }
    }

    /// Returns true if the page is in the set, as pages of the tail always are.
    pub fn contains(&self, pos: PagePos) -> bool {
        let is_set = |(word, bit): (usize, u64)| self.bits[word] & bit != 0;
        !self.numbering.is_finer(pos.level) || self.bit(pos).is_some_and(is_set)
    }

    /// Pages in the set, the tail counted as one.
    pub fn count(&self) -> u64 {
        self.pages
    }

    /// The word and the bit of a page, or `None` if the page does not exist or is the tail.
    fn bit(&self, pos: PagePos) -> Option<(usize, u64)> {
        let entry = self.numbering.entry_if_finer(pos)?;
        Some(((entry / 64) as usize, 1 << (entry % 64)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;
    use proptest::prelude::*;

    fn geometry(volume: bool) -> Geometry {
        let spec = match volume {
            true => GeometrySpec { page: 8, border: 2, ..GeometrySpec::volume([70, 50, 40]) },
            false => GeometrySpec { page: 8, border: 2, ..GeometrySpec::image(300, 170) },
        };
        Geometry::new(spec).unwrap()
    }

    proptest! {
        #[test]
        fn with_a_page_its_ancestors_are_there(volume: bool, chosen in prop::collection::vec(any::<prop::sample::Index>(), 0..40)) {
            let geometry = geometry(volume);
            let pages: Vec<_> = geometry.pages().collect();
            let mut set = PageSet::new(&geometry);
            let mut expected = std::collections::BTreeSet::from([geometry.tail_pos()]);
            for index in chosen {
                let pos = *index.get(&pages);
                set.insert(&geometry, pos);
                expected.extend(std::iter::successors(Some(pos), |&pos| geometry.parent(pos)));
            }
            for &pos in &pages {
                prop_assert_eq!(set.contains(pos), expected.contains(&pos), "{}", pos);
            }
            prop_assert_eq!(set.count(), expected.len() as u64);
            prop_assert_eq!(&PageSet::from_pages(&geometry, |pos| expected.contains(&pos)), &set);
        }
    }

    #[test]
    fn a_page_without_its_ancestors_does_not_count() {
        let geometry = geometry(false);
        let set = PageSet::from_pages(&geometry, |pos| pos.level != 1);
        assert!(set.contains(PagePos::new_2d(2, 0, 0)));
        assert!(!set.contains(PagePos::new_2d(0, 0, 0)));
        assert!(!set.contains(PagePos::new_2d(2, 10_000, 0)));
    }
}
