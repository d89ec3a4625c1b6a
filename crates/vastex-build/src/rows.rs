//! The rows of one level that are still needed: a window that moves down, and the first rows where the bottom edge
//! needs them again.
//!
//! Rows lie in blocks that are used again once nothing needs them, so memory follows the width of the level and never
//! its height.

use std::collections::VecDeque;

/// The order in which the rows of a level are made: from row `first` to the last, then those before it.
///
/// The first rows of a level come last where they are made of what lies across a wrapping edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RowOrder {
    pub(crate) height: u32,
    /// Less than `height`.
    pub(crate) first: u32,
}

impl RowOrder {
    /// From the top.
    #[cfg(test)]
    pub(crate) fn from_top(height: u32) -> RowOrder {
        RowOrder { height, first: 0 }
    }

    /// Rows that are made before row `y`.
    pub(crate) fn rank(self, y: u32) -> u32 {
        if y >= self.first { y - self.first } else { y + (self.height - self.first) }
    }

    /// The row that `rank` others are made before.
    pub(crate) fn row(self, rank: u32) -> u32 {
        let below = self.height - self.first;
        if rank < below { rank + self.first } else { rank - below }
    }
}

/// Rows of one level, filled in their order.
pub(crate) struct Rows {
    order: RowOrder,
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
    /// For rows of `row_bytes` each, in blocks of `block_rows`. The first `head_rows` are never forgotten; those that come
    /// last in the order are among them.
    pub(crate) fn new(order: RowOrder, row_bytes: usize, block_rows: u32, head_rows: u32) -> Rows {
        let head_blocks = head_rows.max(order.first).div_ceil(block_rows);
        Rows {
            order,
            row_bytes,
            block_rows,
            block_bytes: block_rows.min(order.height) as usize * row_bytes,
            head: Vec::new(),
            head_blocks,
            window: VecDeque::new(),
            first_block: head_blocks,
            spare: Vec::new(),
            filled: 0,
            allocated: 0,
        }
    }

    /// The order in which they are filled.
    pub(crate) fn order(&self) -> RowOrder {
        self.order
    }

    /// Rows filled so far.
    pub(crate) fn filled(&self) -> u32 {
        self.filled
    }

    /// Whether all are.
    pub(crate) fn is_complete(&self) -> bool {
        self.filled == self.order.height
    }

    /// Bytes of one row, padding included.
    pub(crate) fn row_bytes(&self) -> usize {
        self.row_bytes
    }

    /// Bytes of all blocks; never falls.
    pub(crate) fn allocated(&self) -> u64 {
        self.allocated
    }

    /// Rows that [`Rows::grow`] can give out at once, unless all are filled.
    pub(crate) fn room(&self) -> u32 {
        let next = self.next();
        let end = if next < self.order.first { self.order.first } else { self.order.height };
        (self.block_rows - next % self.block_rows).min(end - next)
    }

    /// The row that is filled next, unless all are.
    pub(crate) fn next(&self) -> u32 {
        self.order.row(self.filled)
    }

    /// One row that is filled and not forgotten.
    pub(crate) fn row(&self, y: u32) -> &[u8] {
        let (block, start) = self.place(y);
        &block[start..start + self.row_bytes]
    }

    /// So many rows from `y` on in one piece, if they lie so. They are filled and not forgotten.
    pub(crate) fn piece(&self, y: u32, count: u32) -> Option<&[u8]> {
        (y % self.block_rows + count <= self.block_rows).then(|| {
            let (block, start) = self.place(y);
            &block[start..start + count as usize * self.row_bytes]
        })
    }

    /// The block in which a row lies, and where it begins there.
    fn place(&self, y: u32) -> (&[u8], usize) {
        let block = y / self.block_rows;
        let rows = match block < self.head_blocks {
            true => &self.head[block as usize],
            false => &self.window[(block - self.first_block) as usize],
        };
        (rows, (y % self.block_rows) as usize * self.row_bytes)
    }

    /// The next `rows` rows, at most [`Rows::room`], to be filled by the caller.
    pub(crate) fn grow(&mut self, rows: u32) -> &mut [u8] {
        let next = self.next();
        let (block, row) = (next / self.block_rows, next % self.block_rows);
        while self.head.len() as u32 <= block.min(self.head_blocks.saturating_sub(1)) && self.head_blocks > 0
        {
            let fresh = self.fresh();
            self.head.push(fresh);
        }
        while block >= self.head_blocks && self.window.len() as u32 <= block - self.first_block {
            let fresh = self.fresh();
            self.window.push_back(fresh);
        }
        self.filled += rows;
        let target = match block < self.head_blocks {
            true => &mut self.head[block as usize],
            false => &mut self.window[(block - self.first_block) as usize],
        };
        &mut target[row as usize * self.row_bytes..(row + rows) as usize * self.row_bytes]
    }

    fn fresh(&mut self) -> Vec<u8> {
        self.spare.pop().unwrap_or_else(|| {
            self.allocated += self.block_bytes as u64;
            vec![0; self.block_bytes]
        })
    }

    /// Gives up the rows before `y`, except the first ones.
    pub(crate) fn forget_before(&mut self, y: u32) {
        let filled = self.order.first.saturating_add(self.filled).min(self.order.height);
        while (self.first_block + 1).saturating_mul(self.block_rows) <= y.min(filled) {
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
        let mut rows = Rows::new(RowOrder::from_top(1000), 2, 4, 5);
        for y in 0..1000u32 {
            rows.grow(1).copy_from_slice(&(y as u16).to_le_bytes());
            rows.forget_before(y.saturating_sub(9));
            for seen in (0..5.min(y)).chain(y.saturating_sub(9)..=y) {
                assert_eq!(rows.row(seen), (seen as u16).to_le_bytes());
            }
        }
        assert!(rows.allocated() <= 6 * 8, "{}", rows.allocated());
    }

    #[test]
    fn the_first_rows_can_come_last() {
        let order = RowOrder { height: 50, first: 6 };
        let mut rows = Rows::new(order, 1, 4, 3);
        let mut made = Vec::new();
        while !rows.is_complete() {
            let (next, count) = (rows.next(), rows.room());
            let bytes: Vec<u8> = (next..next + count).map(|y| y as u8).collect();
            rows.grow(count).copy_from_slice(&bytes);
            made.extend(next..next + count);
            rows.forget_before(next.saturating_sub(5));
        }
        assert_eq!(made, (6..50).chain(0..6).collect::<Vec<_>>());
        assert!(made.iter().zip(0..).all(|(&y, rank)| order.rank(y) == rank && order.row(rank) == y));
        assert!((0..8).chain(46..50).all(|y| rows.row(y) == [y as u8]));
        assert!(rows.allocated() <= 6 * 4, "{}", rows.allocated());
    }
}
