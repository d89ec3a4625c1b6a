//! A summary of a container, for people and scripts.

use vastex_core::{Description, Level};

use super::Container;
use crate::container::format::layout::VERSION;
use crate::sources::TileSource;
use crate::tile::Codec;

/// What is in a container.
///
/// Every tile is stored, constant, or shared: `tiles = stored_tiles + constant_tiles + shared_tiles`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Info {
    /// Levels, pages, borders and layers.
    pub description: Description,
    /// Version of the container format.
    pub version: u32,
    /// Bytes of the file.
    pub bytes: u64,
    /// Every tile in the file begins at a multiple of so many bytes; 1 for no alignment.
    pub align: u32,
    /// Pages of the texture, the tail counted as one.
    pub pages: u64,
    /// Pages that have a tile.
    pub tiles: u64,
    /// Pages that have a tile, for each level finer than the tail, finest first, and then for the tail.
    pub tiles_by_level: Vec<u64>,
    /// Tiles that have bytes of their own.
    pub stored_tiles: u64,
    /// Tiles that are one colour, kept in the index.
    pub constant_tiles: u64,
    /// Tiles whose bytes are those of another tile, stored once.
    pub shared_tiles: u64,
    /// Stored tiles by codec: raw, LZ4, Zstandard.
    pub stored_by_codec: [u64; 3],
    /// Bytes of the stored tiles.
    pub stored_bytes: u64,
    /// Bytes of all tiles after decoding.
    pub raw_bytes: u64,
}

/// Bytes that a container does not need, compared with storing every tile on its own as it is decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Saved {
    /// Bytes saved by pages that have no tile.
    pub absent: u64,
    /// Bytes saved by tiles that are one colour.
    pub constant: u64,
    /// Bytes saved by tiles whose bytes are those of another tile.
    pub shared: u64,
    /// Bytes saved by compressing the stored tiles; 0 if compression made them larger.
    pub compression: u64,
}

impl Info {
    /// What was saved by leaving out, constant colours, sharing and compression. Together with
    /// [`Info::stored_bytes`] that is what all pages take decoded.
    pub fn saved(&self) -> Saved {
        let decoded = |tiles: u64| tiles.saturating_mul(self.description.tile_bytes() as u64);
        Saved {
            absent: decoded(self.pages - self.tiles),
            constant: decoded(self.constant_tiles),
            shared: decoded(self.shared_tiles),
            compression: decoded(self.stored_tiles).saturating_sub(self.stored_bytes),
        }
    }

    /// The levels of the texture, finest first.
    pub fn levels(&self) -> &[Level] {
        self.description.geometry.levels()
    }
}

impl Container {
    /// Counts what is in the container. Costs a look at each page's number, and no read.
    ///
    /// Records that cannot be read are left out; the program's `vastex verify` reports them.
    pub fn info(&self) -> Info {
        let mut info = Info {
            description: Description::clone(self.description()),
            version: VERSION,
            bytes: self.header.file_len,
            align: self.align(),
            pages: self.numbering.pages() * self.textures(),
            tiles: 0,
            tiles_by_level: vec![0; usize::from(self.description().geometry.tail().first_level()) + 1],
            stored_tiles: 0,
            constant_tiles: 0,
            shared_tiles: 0,
            stored_by_codec: [0; 3],
            stored_bytes: 0,
            raw_bytes: 0,
        };
        let mut seen = vec![false; self.index.records() as usize];
        for (page, number) in (0..).zip(self.index.page_records()) {
            let Some(number) = number else { continue };
            let Ok(record) = self.index.record(number) else { continue };
            info.tiles += 1;
            let level = self.numbering.level_of(page % self.numbering.pages()).map(usize::from);
            if let Some(tiles) = level.and_then(|level| info.tiles_by_level.get_mut(level)) {
                *tiles += 1;
            }
            let counted = std::mem::replace(&mut seen[number as usize], true);
            let by_codec = match record.codec {
                Codec::Constant => {
                    info.constant_tiles += 1;
                    continue;
                }
                Codec::Raw => 0,
                Codec::Lz4 => 1,
                Codec::Zstd => 2,
            };
            if counted {
                info.shared_tiles += 1;
            } else {
                info.stored_tiles += 1;
                info.stored_by_codec[by_codec] += 1;
                info.stored_bytes += record.section.extent.len;
            }
        }
        info.raw_bytes = info.tiles * self.description().tile_bytes() as u64;
        info
    }
}
