//! Which ranges of a pool's arena the direct tables of its textures have. On the CPU alone: what lies there
//! is written elsewhere.
//!
//! The coarse levels of a table, of few entries together, have a range from the beginning; each finer level
//! gets one of its own when it is wanted. So a table that grows leaves what it has where it lies.
//!
//! Room for all levels is reserved when a table comes: where it could not be had, the table is refused. A
//! level that is wanted later thus always finds a range, if need be once all ranges have been given anew,
//! largest first, which leaves no gaps.

use std::collections::{BTreeMap, BTreeSet};

use vastex_core::{Geometry, PageNumbering, PagePos, Slot, TableEntry, TextureNumber};

use super::Placement;
use crate::arena::{Arena, Range};

/// Entries of the levels that a table has from the beginning at most, unless its coarsest has more.
const FEW_ENTRIES: u64 = 128;

/// Which ranges of an arena the direct tables of textures have.
#[derive(Debug)]
pub(super) struct Directory {
    pub(super) arena: Arena,
    pub(super) tables: BTreeMap<TextureNumber, DirectTable>,
    /// Tables with ranges of which nothing was written, or a placement that nobody was told: all others need
    /// no look.
    pub(super) touched: BTreeSet<TextureNumber>,
    /// Tables with ranges where shaders are not to look yet.
    pub(super) hidden: BTreeSet<TextureNumber>,
    /// Entries of the ranges that all tables have with all of their levels.
    reserved: u64,
}

/// The table of one texture.
#[derive(Debug)]
pub(super) struct DirectTable {
    pub(super) geometry: Geometry,
    numbering: PageNumbering,
    /// What entries lead to where nothing finer is resident.
    pub(super) tail: TableEntry,
    /// Coarse levels first.
    pub(super) ranges: Vec<LevelRange>,
    /// True if its placement is another than what was last asked for.
    pub(super) is_placed: bool,
}

/// Where some levels of a table lie.
#[derive(Clone, Debug)]
pub(super) struct LevelRange {
    pub(super) range: Range,
    /// From the finest to the coarsest, which is counted too.
    pub(super) finest: u8,
    pub(super) coarsest: u8,
    /// Of all these levels.
    pub(super) entries: u32,
    /// Nothing of it has been written since it was taken.
    pub(super) is_fresh: bool,
    /// Nothing of it has been written at all.
    pub(super) is_new: bool,
    /// Shaders are not to look here yet, since not all of it has been sent.
    pub(super) is_hidden: bool,
}

impl Directory {
    pub(super) fn new(arena: Arena) -> Directory {
        let (touched, hidden) = (BTreeSet::new(), BTreeSet::new());
        Directory { arena, tables: BTreeMap::new(), touched, hidden, reserved: 0 }
    }

    /// Entries for which there is room.
    pub(super) fn room(&self) -> u64 {
        u64::from(self.arena.most()).saturating_sub(self.reserved)
    }

    /// Returns false where there is no room.
    pub(super) fn add(&mut self, texture: TextureNumber, geometry: &Geometry, tail_slot: Slot) -> bool {
        let full = full_entries(geometry);
        self.remove(texture);
        if full > self.room() {
            return false;
        }
        self.reserved += full;
        let tail = geometry.tail().first_level();
        let table = DirectTable {
            geometry: geometry.clone(),
            numbering: PageNumbering::new(geometry),
            tail: TableEntry::new(tail, tail_slot),
            ranges: Vec::new(),
            is_placed: true,
        };
        self.tables.insert(texture, table);
        self.touched.insert(texture);
        if let Some(finest) = first_level(geometry) {
            self.take(texture, finest, tail - 1);
        }
        true
    }

    pub(super) fn remove(&mut self, texture: TextureNumber) {
        self.touched.remove(&texture);
        self.hidden.remove(&texture);
        if let Some(table) = self.tables.remove(&texture) {
            self.reserved -= full_entries(&table.geometry);
            table.ranges.iter().for_each(|level| self.arena.give(level.range));
        }
    }

    /// Gives a table entries for all levels from `level` on.
    pub(super) fn grow(&mut self, texture: TextureNumber, level: u8) {
        while let Some(finest) = self.tables.get(&texture).map(DirectTable::finest)
            && finest > level
        {
            self.take(texture, finest - 1, finest - 1);
        }
    }

    fn take(&mut self, texture: TextureNumber, finest: u8, coarsest: u8) {
        let Some(table) = self.tables.get_mut(&texture) else { return };
        // What was reserved is within the arena.
        let entries =
            (finest..=coarsest).map(|level| table.geometry.level(level).page_count()).sum::<u64>() as u32;
        let range = self.arena.take(entries);
        let unplaced = LevelRange {
            range: range.unwrap_or(Range::EMPTY),
            finest,
            coarsest,
            entries,
            is_fresh: true,
            is_new: true,
            is_hidden: false,
        };
        table.ranges.push(unplaced);
        table.is_placed = true;
        self.touched.insert(texture);
        if range.is_none() {
            self.give_anew();
        }
    }

    /// Gives all ranges anew, largest first.
    fn give_anew(&mut self) {
        self.arena.clear();
        self.touched.extend(self.tables.keys());
        let tables = self.tables.values_mut();
        let mut levels: Vec<&mut LevelRange> = tables
            .flat_map(|table| {
                table.is_placed = true;
                &mut table.ranges
            })
            .collect();
        levels.sort_by_key(|level| std::cmp::Reverse(Arena::rounded(level.entries.into())));
        for level in levels {
            // They are within what is reserved, and leave no gaps.
            level.range = self.arena.take(level.entries).unwrap_or(Range::EMPTY);
            level.is_fresh = true;
        }
    }

    /// A table is to be written and told anew, with its tail in `tail_slot`.
    pub(super) fn begin_anew(&mut self, texture: TextureNumber, tail_slot: Slot) {
        if let Some(table) = self.tables.get_mut(&texture) {
            table.tail = TableEntry::new(table.tail.level(), tail_slot);
            table.forget_written();
            self.touched.insert(texture);
        }
    }

    /// Everything is to be written and told anew.
    pub(super) fn forget_written(&mut self) {
        self.touched.extend(self.tables.keys());
        self.tables.values_mut().for_each(DirectTable::forget_written);
    }

    /// Entries of all tables as they are now, whether there are pages for them or not; for what is said of
    /// memory.
    #[cfg(test)]
    pub(super) fn taken(&self) -> u64 {
        self.tables
            .values()
            .flat_map(|table| &table.ranges)
            .map(|level| u64::from(level.range.entries()))
            .sum()
    }
}

impl DirectTable {
    /// The finest level that has a range; the tail's first where none has.
    pub(super) fn finest(&self) -> u8 {
        self.ranges.last().map_or(self.tail.level(), |level| level.finest)
    }

    /// The coarsest level that has a range of which nothing was written.
    pub(super) fn coarsest_fresh(&self) -> Option<u8> {
        self.ranges.iter().find(|level| level.is_fresh).map(|level| level.coarsest)
    }

    /// Returns true if nothing of it was written.
    pub(super) fn is_fresh(&self) -> bool {
        self.ranges.iter().all(|level| level.is_fresh)
    }

    fn forget_written(&mut self) {
        self.is_placed = true;
        self.ranges.iter_mut().for_each(|level| level.is_fresh = true);
    }

    /// The first entry of a level, whether shaders look there or not.
    pub(super) fn first_entry(&self, level: u8) -> Option<u32> {
        let of = self.ranges.iter().find(|of| (of.finest..=of.coarsest).contains(&level))?;
        let within = self.numbering.first_entry(level) - self.numbering.first_entry(of.finest);
        Some(of.range.first + within as u32)
    }

    /// `former` are the lengths of the arenas that commands may still see, but for that in which the tables
    /// lie.
    pub(super) fn placement(&self, former: &[u32]) -> Placement {
        let tail = self.tail.level();
        let mut placement = Placement::without_entries(tail);
        for of in self.ranges.iter().take_while(|of| !of.is_hidden) {
            placement.finest = of.finest;
            placement.end = placement.end.max(of.range.first + of.range.entries());
            for level in of.finest..=of.coarsest {
                let first = self.first_entry(level).unwrap_or(Placement::NONE);
                placement.first_entry[usize::from(level)] = first;
            }
        }
        let shorter: Vec<u32> =
            former.iter().copied().filter(|length| *length < placement.least_length()).collect();
        let with_level =
            |length: Option<&u32>| length.map_or((1, tail), |&length| (length, self.finest_in(length)));
        placement.former = [shorter.iter().max(), shorter.iter().min()].map(with_level);
        placement
    }

    /// The finest level from which on all lies in an arena of so many entries.
    fn finest_in(&self, length: u32) -> u8 {
        let is_in = |of: &&LevelRange| !of.is_hidden && of.range.first + of.range.entries() <= length;
        self.ranges.iter().take_while(is_in).last().map_or(self.tail.level(), |of| of.finest)
    }

    /// The entries at and below a page, of the levels up to `coarsest`, row by row: first and count.
    pub(super) fn rows_below(&self, pos: PagePos, coarsest: u8, mut visit: impl FnMut(u32, u32)) {
        for level in self.finest()..=pos.level.min(coarsest) {
            let Some(first) = self.first_entry(level) else { continue };
            let [across, down, _] = self.geometry.level(level).pages;
            let (low, high) = self.geometry.descendants(pos, level);
            for (z, y) in (low[2]..high[2]).flat_map(|z| (low[1]..high[1]).map(move |y| (z, y))) {
                visit(first + (z * down + y) * across + low[0], high[0] - low[0]);
            }
        }
    }
}

/// The finest level that a table begins with: with coarser ones it has few entries. `None` if everything is
/// tail.
fn first_level(geometry: &Geometry) -> Option<u8> {
    let finer_than_tail = 0..geometry.tail().first_level();
    let numbering = PageNumbering::new(geometry);
    let is_few = |&level: &u8| numbering.entries() - numbering.first_entry(level) <= FEW_ENTRIES;
    finer_than_tail.clone().find(is_few).or(finer_than_tail.last())
}

/// Entries of the ranges of a table with all of its levels.
pub(super) fn full_entries(geometry: &Geometry) -> u64 {
    let Some(first) = first_level(geometry) else { return 0 };
    let numbering = PageNumbering::new(geometry);
    let finer = (0..first).map(|level| Arena::rounded(geometry.level(level).page_count())).sum::<u64>();
    finer + Arena::rounded(numbering.entries() - numbering.first_entry(first))
}

#[cfg(test)]
#[path = "directory_tests.rs"]
mod tests;
