//! The rows of one level that are still needed: a window that moves down, and the first rows where the bottom edge
//! needs them again.
//!
//! Rows lie in blocks that are used again once nothing needs them, so memory follows the width of the level and never
//! its height.

use std::collections::VecDeque;

/// Rows of one level, filled from the top.
pub(crate) struct Rows {
    row_bytes: usize,
    block_rows: u32,
    block_bytes: usize,
    /// Blocks that are kept to the end.
    head: Vec<Vec<u8>>,
    head_blocks: u32,
    window: VecDeque<Vec<u8>>,
    /// Number of the window's first block.
    first_block: u32,
    spare: Vec<Vec<u8>>,
    filled: u32,
    allocated: u64,
}

impl Rows {
    /// For `height` rows of `row_bytes` each, in blocks of `block_rows`. The first `head_rows` are never forgotten.
    pub(crate) fn new(height: u32, row_bytes: usize, block_rows: u32, head_rows: u32) -> Rows {
        let head_blocks = head_rows.div_ceil(block_rows);
        Rows {
            row_bytes,
            block_rows,
            block_bytes: block_rows.min(height) as usize * row_bytes,
            head: Vec::new(),
            head_blocks,
            window: VecDeque::new(),
            first_block: head_blocks,
            spare: Vec::new(),
            filled: 0,
            allocated: 0,
        }
    }

    /// Rows filled so far.
    pub(crate) fn filled(&self) -> u32 {
        self.filled
    }

    /// Bytes of one row, padding included.
    pub(crate) fn row_bytes(&self) -> usize {
        self.row_bytes
    }

    /// Bytes of all blocks; never falls.
    pub(crate) fn allocated(&self) -> u64 {
        self.allocated
    }

    /// Rows that [`Rows::grow`] can give out at once.
    pub(crate) fn room(&self) -> u32 {
        self.block_rows - self.filled % self.block_rows
    }

    /// One row that is filled and not forgotten.
    pub(crate) fn row(&self, y: u32) -> &[u8] {
        let block = y / self.block_rows;
        let rows = match block < self.head_blocks {
            true => &self.head[block as usize],
            false => &self.window[(block - self.first_block) as usize],
        };
        let start = (y % self.block_rows) as usize * self.row_bytes;
        &rows[start..start + self.row_bytes]
    }

    /// The next `rows` rows, at most [`Rows::room`], to be filled by the caller.
    pub(crate) fn grow(&mut self, rows: u32) -> &mut [u8] {
        let (block, row) = (self.filled / self.block_rows, self.filled % self.block_rows);
        if row == 0 {
            let fresh = self.spare.pop().unwrap_or_else(|| {
                self.allocated += self.block_bytes as u64;
                vec![0; self.block_bytes]
            });
            if block < self.head_blocks { self.head.push(fresh) } else { self.window.push_back(fresh) }
        }
        self.filled += rows;
        let target = match block < self.head_blocks {
            true => &mut self.head[block as usize],
            false => &mut self.window[(block - self.first_block) as usize],
        };
        &mut target[row as usize * self.row_bytes..(row + rows) as usize * self.row_bytes]
    }

    /// Gives up the rows before `y`, except the first ones.
    pub(crate) fn forget_before(&mut self, y: u32) {
        while (self.first_block + 1).saturating_mul(self.block_rows) <= y.min(self.filled) {
            self.spare.extend(self.window.pop_front());
            self.first_block += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_until_forgotten_and_blocks_are_used_again() {
        let mut rows = Rows::new(1000, 2, 4, 5);
        for y in 0..1000u32 {
            rows.grow(1).copy_from_slice(&(y as u16).to_le_bytes());
            rows.forget_before(y.saturating_sub(9));
            for seen in (0..5.min(y)).chain(y.saturating_sub(9)..=y) {
                assert_eq!(rows.row(seen), (seen as u16).to_le_bytes());
            }
        }
        assert!(rows.allocated() <= 6 * 8, "{}", rows.allocated());
    }
}
