//! How the pages of a texture are numbered where something is kept for each of them: page tables, sets of
//! pages, what pages have in common, the indexes of containers.
//!
//! Pages are counted level after level and row by row, in one of two orders. An *entry* counts from the
//! finest level on and leaves the tail out: shaders find a level by its first entry. A *number* counts in the
//! order of [`Geometry::pages`]: the tail is 0, and the finest level comes last. What is kept for a page is
//! the business of whoever keeps it.

use crate::texture::geometry::Geometry;
use crate::texture::page::PagePos;

/// The entries and numbers of a texture's pages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageNumbering {
    /// The levels finer than the tail, finest first.
    levels: Vec<LevelEntries>,
    entries: u64,
}

/// The entries of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct LevelEntries {
    first: u64,
    pages: [u32; 3],
}

impl LevelEntries {
    /// How many pages of the level come before a page.
    fn within(&self, pos: PagePos) -> u64 {
        let [across, down, _] = self.pages.map(u64::from);
        (u64::from(pos.z) * down + u64::from(pos.y)) * across + u64::from(pos.x)
    }

    fn contains(&self, pos: PagePos) -> bool {
        pos.coords().iter().zip(self.pages).all(|(&coord, pages)| coord < pages)
    }

    /// One past the last entry.
    fn end(&self) -> u64 {
        self.first + self.pages.iter().map(|&n| u64::from(n)).product::<u64>()
    }
}

impl PageNumbering {
    /// The numbering of a texture's pages.
    pub fn new(geometry: &Geometry) -> PageNumbering {
        let mut entries = 0;
        let levels = geometry.levels()[..usize::from(geometry.tail().first_level())]
            .iter()
            .map(|level| {
                let first = entries;
                entries += level.page_count();
                LevelEntries { first, pages: level.pages }
            })
            .collect();
        PageNumbering { levels, entries }
    }

    /// Pages finer than the tail; 0 if the whole texture is tail.
    pub fn entries(&self) -> u64 {
        self.entries
    }

    /// The first entry of a level finer than the tail.
    pub fn first_entry(&self, level: u8) -> u64 {
        self.levels[usize::from(level)].first
    }

    /// The entry of a page that exists and is finer than the tail.
    pub fn entry_of(&self, pos: PagePos) -> u64 {
        let level = &self.levels[usize::from(pos.level)];
        level.first + level.within(pos)
    }

    /// The entry of a page, or `None` if the page is the tail or does not exist.
    pub fn entry_if_finer(&self, pos: PagePos) -> Option<u64> {
        let level = self.levels.get(usize::from(pos.level))?;
        level.contains(pos).then(|| level.first + level.within(pos))
    }

    /// Returns true if a page of this level is finer than the tail.
    pub fn is_finer(&self, level: u8) -> bool {
        usize::from(level) < self.levels.len()
    }

    /// All pages, the tail counted as one: one more than the last number.
    pub fn pages(&self) -> u64 {
        self.entries + 1
    }

    /// The number of a page, or `None` if the page does not exist.
    pub fn number_of(&self, pos: PagePos) -> Option<u64> {
        match self.levels.get(usize::from(pos.level)) {
            Some(level) => level.contains(pos).then(|| self.first_number(level) + level.within(pos)),
            None => (pos == self.tail_pos()).then_some(0),
        }
    }

    /// The page of a number, or `None` for a number beyond the last page.
    pub fn pos_of(&self, number: u64) -> Option<PagePos> {
        let level = self.level_of(number)?;
        let Some(entries) = self.levels.get(usize::from(level)) else { return Some(self.tail_pos()) };
        let [across, down, _] = entries.pages.map(u64::from);
        let within = number - self.first_number(entries);
        let coords = [within % across, within / across % down, within / across / down];
        Some(PagePos::at(level, coords.map(|coord| coord as u32)))
    }

    /// The level of the page of a number, or `None` for a number beyond the last page.
    pub fn level_of(&self, number: u64) -> Option<u8> {
        // Coarser levels have smaller numbers, so the finest level that begins early enough has the page.
        let level = self.levels.iter().position(|level| self.first_number(level) <= number);
        (number < self.pages()).then(|| level.unwrap_or(self.levels.len()) as u8)
    }

    /// The number of the first page of a level: those of the tail and of all coarser levels come before.
    fn first_number(&self, level: &LevelEntries) -> u64 {
        self.pages() - level.end()
    }

    fn tail_pos(&self) -> PagePos {
        PagePos::at(self.levels.len() as u8, [0; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;
    use proptest::prelude::*;

    fn any_geometry() -> impl Strategy<Value = Geometry> {
        (any::<bool>(), prop::array::uniform3(1u32..700), 8u32..60).prop_map(|(volume, size, page)| {
            let spec = match volume {
                true => GeometrySpec::volume(size.map(|side| side.div_ceil(8))),
                false => GeometrySpec::image(size[0], size[1]),
            };
            Geometry::new(GeometrySpec { page, border: 2, ..spec }).unwrap()
        })
    }

    proptest! {
        #[test]
        fn numbers_follow_the_order_of_the_geometry(geometry in any_geometry()) {
            let numbering = PageNumbering::new(&geometry);
            prop_assert_eq!(numbering.pages(), geometry.page_count());
            for (number, pos) in (0..).zip(geometry.pages()) {
                prop_assert_eq!(numbering.number_of(pos), Some(number), "{}", pos);
                prop_assert_eq!(numbering.pos_of(number), Some(pos));
                prop_assert_eq!(numbering.level_of(number), Some(pos.level));
            }
            prop_assert_eq!(numbering.pos_of(numbering.pages()), None);
            prop_assert_eq!(numbering.level_of(u64::MAX), None);
        }

        #[test]
        fn entries_follow_the_levels_finest_first_without_the_tail(geometry in any_geometry()) {
            let numbering = PageNumbering::new(&geometry);
            let finer = (0..geometry.tail().first_level()).flat_map(|level| geometry.pages_of_level(level));
            let mut next = 0;
            for pos in finer {
                prop_assert_eq!(numbering.entry_of(pos), next, "{}", pos);
                prop_assert_eq!(numbering.entry_if_finer(pos), Some(next));
                prop_assert!(numbering.is_finer(pos.level));
                if pos.coords() == [0; 3] {
                    prop_assert_eq!(numbering.first_entry(pos.level), next);
                }
                next += 1;
            }
            prop_assert_eq!(numbering.entries(), next);
            prop_assert_eq!(numbering.entry_if_finer(geometry.tail_pos()), None);
            prop_assert!(!numbering.is_finer(geometry.tail_pos().level));
        }

        #[test]
        fn a_page_that_does_not_exist_has_neither(geometry in any_geometry(), axis in 0usize..3, beyond: u32) {
            let numbering = PageNumbering::new(&geometry);
            for level in 0..=geometry.coarsest().saturating_add(2) {
                let pages = if numbering.is_finer(level) { geometry.level(level).pages } else { [1; 3] };
                let mut coords = [0; 3];
                coords[axis] = pages[axis].saturating_add(beyond);
                let pos = PagePos::at(level, coords);
                prop_assert!(!geometry.contains(pos));
                prop_assert_eq!((numbering.entry_if_finer(pos), numbering.number_of(pos)), (None, None));
            }
        }
    }
}
