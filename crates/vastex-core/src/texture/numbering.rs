//! How the pages of a texture are numbered where each has an entry: level after level, row by row, tails left
//! out.
//!
//! Page tables and the contents of pages are kept in this order. What an entry holds is theirs.

use crate::texture::geometry::Geometry;
use crate::texture::page::PagePos;

/// Where the entries of a texture's levels lie in its table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableLayout {
    levels: Vec<LevelEntries>,
    entries: u64,
}

/// The entries of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct LevelEntries {
    first: u64,
    pages: [u32; 3],
}

impl TableLayout {
    /// The layout for a texture.
    pub fn new(geometry: &Geometry) -> TableLayout {
        let mut entries = 0;
        let levels = geometry.levels()[..usize::from(geometry.tail().first_level())]
            .iter()
            .map(|level| {
                let first = entries;
                entries += level.page_count();
                LevelEntries { first, pages: level.pages }
            })
            .collect();
        TableLayout { levels, entries }
    }

    /// Entries that a direct table is kept for: beyond 4 Mi, 16 MiB, a hashed one takes its place.
    pub const MOST_DIRECT: u64 = 1 << 22;

    /// Entries in the table; 0 where the whole texture is tail.
    pub fn entries(&self) -> u64 {
        self.entries
    }

    /// The first entry of a level finer than the tail.
    pub fn first_entry(&self, level: u8) -> u64 {
        self.levels[usize::from(level)].first
    }

    /// The entry of a page that exists; nothing for a page of the tail.
    pub fn entry_if_finer(&self, pos: PagePos) -> Option<u64> {
        (usize::from(pos.level) < self.levels.len()).then(|| self.entry_of(pos))
    }

    /// The entry of a page finer than the tail.
    pub fn entry_of(&self, pos: PagePos) -> u64 {
        let level = &self.levels[usize::from(pos.level)];
        let [nx, ny, _] = level.pages.map(u64::from);
        level.first + (u64::from(pos.z) * ny + u64::from(pos.y)) * nx + u64::from(pos.x)
    }
}
