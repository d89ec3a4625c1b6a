//! The page table of a pool whose textures have too many pages for an entry each: one hash table of what is
//! resident, of all textures of the pool.
//!
//! Its memory follows the pages that are resident, not those that there are. A page that is resident is found
//! by one probe sequence; for one that is not, a lookup goes up its ancestors, with one sequence for each, to
//! the tail at last, which needs no entry. Pages that share a slot have an entry each.
//!
//! | | |
//! |---|---|
//! | buckets | a power of two, at least those that the table was made with, each with a page and an entry, or free |
//! | where a page is | in the first free bucket from its home on; home is a hash of its id, that of the texture included |
//! | load | at most half; a table that grows or shrinks is filled to a quarter or less |
//! | probe sequence | at most `HASHED_PROBES` buckets: where a page would lie farther from home, the table grows and hashes anew |
//! | a page that leaves | closes the gap behind it, so that nothing is ever marked as gone |
//!
//! The same changes in the same order give the same buckets. A GPU keeps a copy of the buckets, and is sent
//! those that have changed.

use crate::shader_constants::{
    HASH_HIGH, HASH_LAST, HASH_LOW, HASHED_FEWEST_BITS, HASHED_PROBES, TEXTURE_SHIFT,
};
use crate::table::pool::Slot;
use crate::table::{ChangeRule, PageTable, TableChange, TableEntry};
use crate::texture::geometry::Geometry;
use crate::texture::page::{PageId, PagePos, TextureNumber};

/// A page and where its tile is, as a GPU reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HashedBucket {
    /// The page's id, low half first.
    page: [u32; 2],
    entry: u32,
}

impl HashedBucket {
    /// Nobody's. No page has such a high half: no texture has such a number.
    const FREE: HashedBucket = HashedBucket { page: [u32::MAX; 2], entry: u32::MAX };
    /// Words that a bucket takes.
    pub const WORDS: usize = 3;

    fn is_free(self) -> bool {
        self == HashedBucket::FREE
    }

    /// The low and the high half of the page, and the entry; all ones where it is free.
    pub fn words(self) -> [u32; HashedBucket::WORDS] {
        [self.page[0], self.page[1], self.entry]
    }
}

/// The page table of the textures of a pool that have too many pages for an entry each: a hash table of their
/// resident pages.
///
/// Its memory follows the pages that are resident. A resident page is found by one probe sequence of at most
/// `HASHED_PROBES` buckets; of another page a lookup goes up the ancestors, with a sequence for each, to the
/// tail, which needs no entry. At most half of the buckets are filled.
#[derive(Clone, Debug)]
pub struct HashedTable {
    fewest: usize,
    buckets: Vec<HashedBucket>,
    pages: usize,
    /// Places written since they were last asked for, some more than once; `None` if all of them may have
    /// been.
    written: Option<Vec<u32>>,
    /// The table as it lay before its buckets became others, since they were last asked for.
    before: Option<Box<HashedTable>>,
}

impl HashedTable {
    /// Buckets of every table at least.
    pub const FEWEST: usize = 1 << HASHED_FEWEST_BITS;

    /// A table in which every page leads to its tail, with buckets of which `pages` pages fill a quarter at
    /// most; it grows where there are more, and never has fewer.
    pub fn new(pages: usize) -> HashedTable {
        let fewest = (pages * 4).next_power_of_two().max(HashedTable::FEWEST);
        let buckets = vec![HashedBucket::FREE; fewest];
        HashedTable { fewest, buckets, pages: 0, written: None, before: None }
    }

    /// The entry of a page if that is resident: one probe sequence.
    pub fn get(&self, page: PageId) -> Option<TableEntry> {
        let at = self.find(key(page)).ok()?;
        Some(TableEntry::from_bits(self.buckets[at].entry))
    }

    /// The entry of the finest resident page of a texture that covers `pos`: `tail` where none finer is.
    pub fn lookup_in(
        &self,
        geometry: &Geometry,
        texture: TextureNumber,
        tail: TableEntry,
        pos: PagePos,
    ) -> TableEntry {
        let line = std::iter::successors(Some(pos), |&pos| geometry.parent(pos));
        let mut finer = line.take_while(|&pos| !geometry.is_tail(pos));
        let own = |pos| self.get(PageId::new(texture, geometry.dims(), pos).ok()?);
        finer.find_map(own).unwrap_or(tail)
    }

    /// Takes out all pages of a texture, as if each had been evicted. Costs a visit of each bucket. The
    /// buckets stay as many as they are.
    pub fn remove_texture(&mut self, texture: TextureNumber) {
        let is_of =
            |bucket: &&HashedBucket| bucket.page[1] >> (TEXTURE_SHIFT - 32) == u32::from(texture.number());
        let pages: Vec<[u32; 2]> = self.buckets.iter().filter(is_of).map(|bucket| bucket.page).collect();
        for page in pages {
            if let Ok(at) = self.find(page) {
                self.remove(at);
            }
        }
    }

    /// Carries out changes, evictions before loads, as [`TableImage`](crate::TableImage) does one by one.
    pub fn apply(&mut self, changes: &[TableChange]) {
        self.evict(changes);
        self.load(changes);
    }

    /// Carries out the evictions alone. Number and place of the buckets do not change.
    pub fn evict(&mut self, changes: &[TableChange]) {
        for TableChange { page, rule, entry } in changes {
            let ChangeRule::Naming(old) = *rule else { continue };
            match self.find(key(*page)) {
                Ok(at) if self.buckets[at].entry == old.to_bits() && entry.level() == page.level() => {
                    self.write(at, HashedBucket { page: key(*page), entry: entry.to_bits() });
                }
                Ok(at) if self.buckets[at].entry == old.to_bits() => self.remove(at),
                _ => {}
            }
        }
    }

    /// Carries out the loads, for which there may have to be more buckets, or fewer where pages have gone.
    pub fn load(&mut self, changes: &[TableChange]) {
        for TableChange { page, rule, entry } in changes {
            if *rule == ChangeRule::Coarser && self.find(key(*page)).is_err() {
                self.insert(HashedBucket { page: key(*page), entry: entry.to_bits() });
            }
        }
        if self.buckets.len() > self.fewest && self.pages * 16 < self.buckets.len() {
            self.hash_anew((self.pages * 4).next_power_of_two().max(self.fewest));
        }
    }

    /// Pages that have an entry.
    pub fn len(&self) -> usize {
        self.pages
    }

    /// Returns true if everything leads to the tail.
    pub fn is_empty(&self) -> bool {
        self.pages == 0
    }

    /// All buckets, a power of two of them.
    pub fn buckets(&self) -> &[HashedBucket] {
        &self.buckets
    }

    /// Seed of the hashes: how often the fewest buckets are doubled for as many as there are, so that it is
    /// another at every rehash, and known where the buckets are.
    pub fn seed(&self) -> u32 {
        self.buckets.len().ilog2() - HASHED_FEWEST_BITS
    }

    /// Places from the home of the farthest page to where it is, both counted; 0 where there is none.
    pub fn longest_probe(&self) -> usize {
        let taken = self.buckets.iter().enumerate().filter(|(_, bucket)| !bucket.is_free());
        taken.map(|(at, bucket)| self.distance(bucket.page, at) + 1).max().unwrap_or(0)
    }

    /// Which buckets were written since the last call, in ascending order; `None` if all may have been, and
    /// be of another number, as it is of a new table.
    pub fn take_written(&mut self) -> Option<Vec<u32>> {
        self.before = None;
        let mut written = self.written.replace(Vec::new())?;
        written.sort_unstable();
        written.dedup();
        Some(written)
    }

    /// The table as it was before its number of buckets changed, if it has changed since
    /// [`HashedTable::take_written`], which is to be called after this: its changes are for readers that
    /// still have the old buckets. Evicted pages are gone from it as from the new one, and it takes further
    /// [evictions](HashedTable::evict).
    pub fn take_before(&mut self) -> Option<HashedTable> {
        self.before.take().map(|before| *before)
    }

    /// `Ok` with the bucket of the page, or `Err` with the first free one of its probe sequence. Terminates:
    /// half of the buckets are always free.
    fn find(&self, page: [u32; 2]) -> Result<usize, usize> {
        let mask = self.buckets.len() - 1;
        let mut at = self.home(page);
        loop {
            let bucket = self.buckets[at];
            if bucket.is_free() {
                return Err(at);
            }
            if bucket.page == page {
                return Ok(at);
            }
            at = (at + 1) & mask;
        }
    }

    fn home(&self, page: [u32; 2]) -> usize {
        hash(page, self.seed()) as usize & (self.buckets.len() - 1)
    }

    fn distance(&self, page: [u32; 2], at: usize) -> usize {
        at.wrapping_sub(self.home(page)) & (self.buckets.len() - 1)
    }

    fn write(&mut self, at: usize, bucket: HashedBucket) {
        self.buckets[at] = bucket;
        if let Some(written) = &mut self.written {
            written.push(at as u32);
        }
    }

    /// Puts in a page that is not there.
    fn insert(&mut self, bucket: HashedBucket) {
        let is_full = (self.pages + 1) * 2 > self.buckets.len();
        match self.find(bucket.page) {
            Err(at) if !is_full && self.distance(bucket.page, at) < HASHED_PROBES as usize => {
                self.write(at, bucket);
                self.pages += 1;
            }
            _ => {
                self.hash_anew(self.buckets.len() * 2);
                self.insert(bucket);
            }
        }
    }

    /// Frees a bucket, and closes the gap: of those behind it up to the next free one, each comes forward
    /// that is not before its home then.
    fn remove(&mut self, mut gap: usize) {
        let mask = self.buckets.len() - 1;
        let mut at = gap;
        loop {
            at = (at + 1) & mask;
            let bucket = self.buckets[at];
            if bucket.is_free() {
                break;
            }
            if self.distance(bucket.page, at) >= (at.wrapping_sub(gap) & mask) {
                self.write(gap, bucket);
                gap = at;
            }
        }
        self.write(gap, HashedBucket::FREE);
        self.pages -= 1;
    }

    /// Begins anew with so many buckets, or more until every page is near its home.
    fn hash_anew(&mut self, buckets: usize) {
        let count = std::mem::take(&mut self.pages);
        let old = std::mem::replace(&mut self.buckets, vec![HashedBucket::FREE; buckets]);
        let written = self.written.take();
        old.iter().filter(|bucket| !bucket.is_free()).for_each(|&bucket| self.insert(bucket));
        if written.is_some() {
            let before =
                HashedTable { fewest: self.fewest, buckets: old, pages: count, written, before: None };
            self.before = Some(Box::new(before));
        }
    }
}

/// A hashed table of a single texture, with what a lookup needs to know: for tests, and where there is no
/// GPU.
#[derive(Clone, Debug)]
pub struct HashedTextureTable {
    /// The table.
    pub table: HashedTable,
    geometry: Geometry,
    texture: TextureNumber,
    tail: TableEntry,
}

impl HashedTextureTable {
    /// A table in which every page leads to the tail, which lies in `tail_slot`.
    pub fn new(geometry: &Geometry, texture: TextureNumber, tail_slot: Slot) -> HashedTextureTable {
        let tail = TableEntry::new(geometry.tail().first_level(), tail_slot);
        HashedTextureTable { table: HashedTable::new(0), geometry: geometry.clone(), texture, tail }
    }
}

impl PageTable for HashedTextureTable {
    fn lookup(&self, pos: PagePos) -> TableEntry {
        self.table.lookup_in(&self.geometry, self.texture, self.tail, pos)
    }
}

/// The page's id, low half first.
fn key(page: PageId) -> [u32; 2] {
    let bits = page.to_bits();
    [bits as u32, (bits >> 32) as u32]
}

/// `vastexi_hash`: every bit of the page bears on every bit of the hash.
fn hash([low, high]: [u32; 2], seed: u32) -> u32 {
    let low = (low ^ seed).wrapping_mul(HASH_LOW);
    let both = ((low ^ low >> 16) ^ high).wrapping_mul(HASH_HIGH);
    let mixed = (both ^ both >> 13).wrapping_mul(HASH_LAST);
    mixed ^ mixed >> 16
}

#[cfg(test)]
mod tests;
