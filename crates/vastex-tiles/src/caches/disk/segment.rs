//! A segment: two files that only grow, one of tiles end to end, one of their heads.
//!
//! A tile is written before its head, so that there is no head without its tile. After a loss of power there
//! may be one all the same, which the checksum of the tile shows.

use std::io;
use std::sync::Arc;

use super::entry::{EntryKey, HEAD_BYTES, Head};
use super::index::Location;
use super::medium::{Medium, MediumFile};
use crate::ground::hash::checksum;
use crate::tile::Tile;

/// Heads that are read at a time when a segment is opened.
const HEADS_AT_A_TIME: usize = 1024;
/// Digits of a segment's number in the names of its files.
const DIGITS: usize = 16;

/// The names of a segment's files: of its tiles, and of their heads.
pub(super) fn names(number: u64) -> [String; 2] {
    [format!("{number:016x}.tiles"), format!("{number:016x}.heads")]
}

/// The number of the segment to which a file of this name belongs, or `None` if the name is none that a
/// segment writes.
pub(super) fn number_of(name: &str) -> Option<u64> {
    let digits = name.strip_suffix(".tiles").or_else(|| name.strip_suffix(".heads"))?;
    let number = u64::from_str_radix(digits, 16).ok()?;
    (digits.len() == DIGITS && names(number).iter().any(|own| own == name)).then_some(number)
}

/// The two files of a segment with their lengths, and the keys of its entries.
pub(super) struct Segment {
    pub(super) number: u64,
    tiles: Arc<dyn MediumFile>,
    /// Open as long as the segment may grow.
    heads: Option<Arc<dyn MediumFile>>,
    tiles_len: u64,
    heads_len: u64,
    /// The keys of all entries ever written, in order; some of these entries may lie in other segments by
    /// now.
    pub(super) keys: Vec<EntryKey>,
}

impl Segment {
    /// Creates an empty segment.
    pub(super) fn create(medium: &dyn Medium, number: u64) -> io::Result<Segment> {
        let [of_tiles, of_heads] = names(number);
        let tiles = medium.open(&of_tiles, true)?;
        let heads = medium.open(&of_heads, true).inspect_err(|_| drop(medium.remove(&of_tiles)))?;
        Ok(Segment { number, tiles, heads: Some(heads), tiles_len: 0, heads_len: 0, keys: Vec::new() })
    }

    /// Opens a segment that exists, and lists its entries in the order in which they were written, without
    /// damaged ones.
    pub(super) fn open(medium: &dyn Medium, number: u64) -> io::Result<(Segment, Vec<Location>)> {
        let [tiles, heads] = names(number).map(|name| medium.open(&name, false));
        let (tiles, heads) = (tiles?, heads?);
        let (tiles_len, mut heads_len) = (tiles.len()?, heads.len()?);
        let locations: Vec<_> = sound_heads(&*heads, tiles_len)?
            .into_iter()
            .map(|head| Location::new(number, tiles.clone(), head))
            .collect();
        // What the last write left of a head gives way to the next.
        let torn = heads_len % HEAD_BYTES as u64;
        let can_grow = torn == 0 || heads.truncate(heads_len - torn).is_ok();
        let heads = can_grow.then_some(heads);
        if can_grow {
            heads_len -= torn;
        }
        let keys = locations.iter().map(|location| location.head.key).collect();
        Ok((Segment { number, tiles, heads, tiles_len, heads_len, keys }, locations))
    }

    /// Ends the growth of the segment.
    pub(super) fn seal(&mut self) {
        self.heads = None;
    }

    /// Bytes of both files. After a failed write, the most that they can be.
    pub(super) fn bytes(&self) -> u64 {
        self.tiles_len + self.heads_len
    }

    /// Returns true if `bytes` more may be written to the segment, which should have no more than `target`.
    pub(super) fn has_room(&self, bytes: u64, target: u64) -> bool {
        self.heads.is_some() && (self.bytes() == 0 || self.bytes().saturating_add(bytes) <= target)
    }

    /// Writes an entry. If that fails, the segment is as it was, or sealed.
    pub(super) fn append(&mut self, key: EntryKey, tile: &Tile, len: u32) -> io::Result<Location> {
        let heads = self.heads.clone().ok_or_else(|| io::Error::other("the segment is sealed"))?;
        let (offset, checksum) = (self.tiles_len, checksum(&tile.bytes));
        let head = Head { key, codec: tile.codec, offset, len, checksum };
        let tile_written = self.tiles.write_at(&tile.bytes, offset);
        let written = tile_written.and_then(|()| heads.write_at(&head.encode(), self.heads_len));
        let is_cut_back = written.is_err() && {
            let cut = heads.truncate(self.heads_len);
            self.tiles.truncate(self.tiles_len).and(cut).is_ok()
        };
        // What could not be taken back is counted as if all of it were there.
        if !is_cut_back {
            self.tiles_len += u64::from(len);
            self.heads_len += HEAD_BYTES as u64;
        }
        if written.is_err() && !is_cut_back {
            self.seal();
        }
        written?;
        self.keys.push(key);
        Ok(Location::new(self.number, self.tiles.clone(), head))
    }
}

/// Removes the files of a segment, as far as they exist.
pub(super) fn remove(medium: &dyn Medium, number: u64) -> io::Result<()> {
    names(number).iter().rev().try_for_each(|name| match medium.remove(name) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    })
}

fn sound_heads(file: &dyn MediumFile, tiles_len: u64) -> io::Result<Vec<Head>> {
    let mut heads = Vec::new();
    let (mut bytes, mut offset) = (vec![0; HEADS_AT_A_TIME * HEAD_BYTES], 0);
    loop {
        let count = file.read_at(&mut bytes, offset)?;
        let (whole, _) = bytes[..count].as_chunks::<HEAD_BYTES>();
        heads.extend(whole.iter().filter_map(|bytes| Head::decode(bytes, tiles_len)));
        if count < bytes.len() {
            return Ok(heads);
        }
        offset += count as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_that_it_would_write_are_its_own() {
        assert_eq!(names(0x1f), ["000000000000001f.tiles", "000000000000001f.heads"]);
        for name in names(u64::MAX) {
            assert_eq!(number_of(&name), Some(u64::MAX));
        }
        for name in
            ["1f.tiles", "000000000000001F.tiles", "+00000000000001f.tiles", "000000000000001f", "lock"]
        {
            assert_eq!(number_of(name), None, "{name}");
        }
    }
}
