//! Blocks of an OpenEXR file: decompressed, whatever their bytes are, and counted.

use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::error::{Error, Result};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};

use crate::image::quiet;

/// Decompresses a block. The library's decoders panic at some damaged ones: that is an error here like any
/// other.
pub(super) fn decompress(chunk: Chunk, meta: &MetaData) -> Result<UncompressedBlock> {
    // Nothing of what a decoder that panicked was given is used afterwards.
    let decompressed = quiet::catch(|| UncompressedBlock::decompress_chunk(chunk, meta, false));
    decompressed.unwrap_or_else(|_| Err(Error::Invalid("compressed data".into())))
}

/// Which blocks were read, a bit for each: blocks lie on a grid, so one that begins in a cell where none did
/// covers texels that none did. There may be as many as texels.
pub(super) struct Places {
    block: [usize; 2],
    columns: usize,
    cells: usize,
    /// Nothing is allocated before the first.
    read: Vec<u64>,
}

impl Places {
    pub(super) fn of(part: &Header) -> Places {
        let (width, height) = (part.layer_size.width(), part.layer_size.height());
        let block = match part.blocks {
            BlockDescription::ScanLines => [width, part.compression.scan_lines_per_block()],
            BlockDescription::Tiles(tiles) => [tiles.tile_size.width(), tiles.tile_size.height()],
        }
        .map(|side| side.max(1));
        let columns = width.div_ceil(block[0]);
        Places { block, columns, cells: columns.saturating_mul(height.div_ceil(block[1])), read: Vec::new() }
    }

    /// Bytes that they take.
    pub(super) fn bytes(&self) -> u64 {
        self.cells.div_ceil(64) as u64 * 8
    }

    /// Marks the block that begins at a texel; whether it was not marked yet.
    pub(super) fn insert(&mut self, [x, y]: [usize; 2]) -> bool {
        self.read.resize(self.cells.div_ceil(64), 0);
        let cell = y / self.block[1] * self.columns + x / self.block[0];
        let (Some(word), bit) = (self.read.get_mut(cell / 64), 1 << (cell % 64)) else { return false };
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_block_of_a_grid_counts_once() {
        let mut places = Places { block: [16, 8], columns: 3, cells: 3 * 5, read: Vec::new() };
        assert_eq!(places.bytes(), 8);
        for at in [[0, 0], [16, 0], [32, 0], [0, 32], [32, 32]] {
            assert!(places.insert(at) && !places.insert(at), "{at:?}");
        }
        assert!(!places.insert([0, 40 * 16]), "beyond the grid");
    }
}
