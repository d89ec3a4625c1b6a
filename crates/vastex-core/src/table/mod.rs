//! The page table: page -> slot, and the changes that keep it true. This is the direct one, of a texture;
//! [`HashedTable`](crate::HashedTable) is that of a pool whose textures have more pages than it is worth an
//! entry each.
//!
//! A table has one entry for each page finer than the tail, level after level, row by row. It is filled
//! downward: an entry without a tile of its own holds that of its nearest resident ancestor, the tail at
//! last, so that a lookup never loops. [`TableImage`] is the CPU's copy; a GPU keeps its own and applies the
//! same [`TableChange`]s. Which pages are resident is decided elsewhere ([`Pager`](crate::Pager)).
//!
//! Changes come in batches, evictions before loads, and act as if in sequence. Two properties make any order
//! *within* the evictions, and within the loads, give that result, so that a GPU may apply each half in
//! parallel:
//! - an eviction's `entry` is the nearest ancestor that stays resident, so no entry is changed by two
//!   evictions;
//! - a load takes effect where it is finer than what stands there, and an entry with a finer level is the
//!   smaller number, so a load is a minimum.

pub(crate) mod estimate;
pub(crate) mod hashed_table;
pub(crate) mod pool;

use crate::shader_constants::{ENTRY_SLOT_BITS, LEVEL_BITS};
use crate::table::pool::Slot;
use crate::texture::geometry::Geometry;
use crate::texture::numbering::PageNumbering;
use crate::texture::page::{PageId, PagePos};

/// What a lookup finds: a slot, and the level of the page whose tile is in it. Never a page id, so that pages
/// with the same content can share a slot.
///
/// | bits | field |
/// |---|---|
/// | 0..27 | slot |
/// | 27..32 | level |
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TableEntry(u32);

impl TableEntry {
    /// An entry; `slot` has at most 27 bits ([`PoolLayout`](crate::PoolLayout) sees to that) and `level` 5.
    pub fn new(level: u8, slot: Slot) -> TableEntry {
        debug_assert!(slot.index() >> ENTRY_SLOT_BITS == 0 && level >> LEVEL_BITS == 0);
        TableEntry(u32::from(level) << ENTRY_SLOT_BITS | slot.index())
    }

    /// The level of the page whose tile is in the slot.
    pub fn level(self) -> u8 {
        (self.0 >> ENTRY_SLOT_BITS) as u8
    }

    /// The slot.
    pub fn slot(self) -> Slot {
        Slot::new(self.0 & ((1 << ENTRY_SLOT_BITS) - 1))
    }

    /// The packed bits.
    pub fn to_bits(self) -> u32 {
        self.0
    }

    /// An entry from its packed bits.
    pub fn from_bits(bits: u32) -> TableEntry {
        TableEntry(bits)
    }
}

/// What leads from pages to slots: [`TableImage`], or [`HashedTextureTable`](crate::HashedTextureTable) where
/// that would be too large.
pub trait PageTable: std::fmt::Debug {
    /// The entry of a page: the slot and level of the finest resident page that covers it.
    fn lookup(&self, pos: PagePos) -> TableEntry;
}

/// Which entries at and below the page a change replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeRule {
    /// A page was loaded: those that name something coarser.
    Coarser,
    /// A page was evicted: exactly those that name it.
    Naming(TableEntry),
}

/// One change: the entries of a page and of all its descendants, by a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableChange {
    /// The page loaded or evicted; finer than the tail.
    pub page: PageId,
    /// Which entries are replaced.
    pub rule: ChangeRule,
    /// The entry that replaces them.
    pub entry: TableEntry,
}

/// The CPU's copy of one texture's page table.
#[derive(Clone, Debug)]
pub struct TableImage {
    numbering: PageNumbering,
    entries: Vec<TableEntry>,
    tail: TableEntry,
}

impl TableImage {
    /// Entries that a direct table is kept for: beyond 4 Mi, 16 MiB, a hashed one takes its place.
    pub const MOST_ENTRIES: u64 = 1 << 22;

    /// A table in which every entry leads to the tail, which lies in `tail_slot`.
    pub fn new(geometry: &Geometry, tail_slot: Slot) -> TableImage {
        let numbering = PageNumbering::new(geometry);
        let tail = TableEntry::new(geometry.tail().first_level(), tail_slot);
        TableImage { entries: vec![tail; numbering.entries() as usize], numbering, tail }
    }

    /// Carries out one change, and says how many entries are others now; costs one visit of each entry at and
    /// below the page.
    pub fn apply(&mut self, geometry: &Geometry, change: &TableChange) -> u64 {
        let mut replaced = 0;
        let pos = change.page.pos(geometry.dims());
        for level in 0..=pos.level {
            let (lo, hi) = geometry.descendants(pos, level);
            for z in lo[2]..hi[2] {
                for y in lo[1]..hi[1] {
                    let first = self.numbering.entry_of(PagePos { level, x: lo[0], y, z }) as usize;
                    for entry in &mut self.entries[first..first + (hi[0] - lo[0]) as usize] {
                        let replace = match change.rule {
                            ChangeRule::Coarser => entry.level() > change.entry.level(),
                            ChangeRule::Naming(old) => *entry == old,
                        };
                        if replace {
                            *entry = change.entry;
                            replaced += 1;
                        }
                    }
                }
            }
        }
        replaced
    }

    /// All entries, in the order of [`PageNumbering`].
    pub fn entries(&self) -> &[TableEntry] {
        &self.entries
    }
}

impl PageTable for TableImage {
    fn lookup(&self, pos: PagePos) -> TableEntry {
        self.numbering.entry_if_finer(pos).map_or(self.tail, |entry| self.entries[entry as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;
    use crate::texture::page::TextureNumber;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// What the table must say, found by walking up from each page.
    fn check(image: &TableImage, geometry: &Geometry, resident: &BTreeMap<PagePos, Slot>) {
        for pos in geometry.pages() {
            let mut at = pos;
            let expected = loop {
                if let Some(&slot) = resident.get(&at) {
                    break TableEntry::new(at.level, slot);
                }
                at = geometry.parent(at).expect("the tail is resident");
            };
            assert_eq!(image.lookup(pos), expected, "{pos}");
        }
    }

    proptest! {
        #[test]
        fn every_entry_leads_to_the_finest_resident_ancestor(
            w in 1u32..900, h in 1u32..900, ops in prop::collection::vec(any::<prop::sample::Index>(), 1..60),
        ) {
            let geometry = Geometry::new(GeometrySpec { page: 40, ..GeometrySpec::image(w, h) }).unwrap();
            let pages: Vec<_> = geometry.pages().skip(1).collect();
            prop_assume!(!pages.is_empty());
            let texture = TextureNumber::new(0).unwrap();
            let mut resident = BTreeMap::from([(geometry.tail_pos(), Slot::new(0))]);
            let mut image = TableImage::new(&geometry, Slot::new(0));
            for (n, op) in ops.iter().enumerate() {
                let pos = pages[op.index(pages.len())];
                let page = PageId::new(texture, geometry.dims(), pos).unwrap();
                let (rule, entry) = match resident.remove(&pos) {
                    Some(slot) => {
                        let ancestor = std::iter::successors(geometry.parent(pos), |&p| geometry.parent(p))
                            .find(|p| resident.contains_key(p)).unwrap();
                        (ChangeRule::Naming(TableEntry::new(pos.level, slot)), TableEntry::new(ancestor.level, resident[&ancestor]))
                    }
                    None => {
                        let slot = Slot::new(n as u32 + 1);
                        resident.insert(pos, slot);
                        (ChangeRule::Coarser, TableEntry::new(pos.level, slot))
                    }
                };
                image.apply(&geometry, &TableChange { page, rule, entry });
                check(&image, &geometry, &resident);
            }
        }
    }

    #[test]
    fn a_finer_entry_is_a_smaller_number() {
        let (finer, coarser) = (TableEntry::new(1, Slot::new(900)), TableEntry::new(2, Slot::new(3)));
        assert!(finer.to_bits() < coarser.to_bits());
        assert_eq!((finer.level(), finer.slot()), (1, Slot::new(900)));
    }
}
