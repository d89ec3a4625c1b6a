//! The rows of one level that are still needed: a window that moves down, and the first rows where the bottom
//! edge needs them again.
//!
//! Rows lie in blocks that are used again once nothing needs them, so memory follows the width of the level
//! and never its height. Tiles are encoded while the rows below them are made: whoever holds a row ([`Row`])
//! keeps its block as it is, and rows that come into such a block go into a copy of it.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

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

/// A row that stays as it is for as long as this is held.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    block: Arc<Vec<u8>>,
    /// Where it lies in the block.
    bytes: Range<usize>,
}

impl Row {
    /// A row of its own.
    pub(crate) fn alone(bytes: Vec<u8>) -> Row {
        Row { bytes: 0..bytes.len(), block: Arc::new(bytes) }
    }

    /// The row's bytes.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.block[self.bytes.clone()]
    }

    /// The bytes of rows that follow one another in one block without a gap; `None` if these do not.
    pub(crate) fn joined(rows: &[Row]) -> Option<&[u8]> {
        let follows =
            |two: &[Row]| Arc::ptr_eq(&two[0].block, &two[1].block) && two[0].bytes.end == two[1].bytes.start;
        let (first, last) = (rows.first()?, rows.last()?);
        rows.windows(2).all(follows).then(|| &first.block[first.bytes.start..last.bytes.end])
    }
}

/// Rows of one level, filled in their order.
pub(crate) struct Rows {
    order: RowOrder,
    row_bytes: usize,
    block_rows: u32,
    block_bytes: usize,
    /// Blocks that are kept to the end.
    head: Vec<Arc<Vec<u8>>>,
    head_blocks: u32,
    window: VecDeque<Arc<Vec<u8>>>,
    /// Number of the window's first block.
    first_block: u32,
    /// Blocks of rows that are forgotten here; some may still hold them.
    spare: Vec<Arc<Vec<u8>>>,
    filled: u32,
    allocated: u64,
}

impl Rows {
    /// For rows of `row_bytes` each, in blocks of `block_rows`. The first `head_rows` are never forgotten;
    /// those that come last in the order are among them.
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

    /// Returns true if all are.
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

    /// One row that is filled and not forgotten, to be held.
    pub(crate) fn held(&self, y: u32) -> Row {
        let (block, start) = self.place(y);
        Row { block: block.clone(), bytes: start..start + self.row_bytes }
    }

    /// The block in which a row lies, and where it begins there.
    fn place(&self, y: u32) -> (&Arc<Vec<u8>>, usize) {
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
        self.unshare(block);
        let bytes = row as usize * self.row_bytes..(row + rows) as usize * self.row_bytes;
        // Nobody else holds it, so nothing is copied here.
        &mut Arc::make_mut(self.block_mut(block))[bytes]
    }

    fn block_mut(&mut self, block: u32) -> &mut Arc<Vec<u8>> {
        match block < self.head_blocks {
            true => &mut self.head[block as usize],
            false => &mut self.window[(block - self.first_block) as usize],
        }
    }

    /// Puts a copy in the place of a block that others hold rows of.
    fn unshare(&mut self, block: u32) {
        if Arc::get_mut(self.block_mut(block)).is_none() {
            let mut copy = self.fresh();
            let place = self.block_mut(block);
            Arc::make_mut(&mut copy).copy_from_slice(place);
            let held = std::mem::replace(place, copy);
            self.spare.push(held);
        }
    }

    /// A block of which nobody holds a row.
    fn fresh(&mut self) -> Arc<Vec<u8>> {
        if let Some(unused) = self.spare.iter_mut().position(|block| Arc::get_mut(block).is_some()) {
            return self.spare.swap_remove(unused);
        }
        self.allocated += self.block_bytes as u64;
        Arc::new(vec![0; self.block_bytes])
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
    fn a_row_that_is_held_stays_as_it_is() {
        let mut rows = Rows::new(RowOrder::from_top(64), 2, 4, 0);
        let mut held: VecDeque<(u32, Row)> = VecDeque::new();
        for y in 0..64u32 {
            rows.grow(1).copy_from_slice(&(y as u16).to_le_bytes());
            held.push_back((y, rows.held(y)));
            rows.forget_before(y);
            // The row before is in the same block, or in a copy of it.
            assert!(y % 4 == 0 || rows.row(y - 1) == (y as u16 - 1).to_le_bytes());
            for (y, row) in &held {
                assert_eq!(row.bytes(), (*y as u16).to_le_bytes());
            }
            if held.len() == 6 {
                held.pop_front();
            }
        }
        // Blocks come back when nobody holds a row of them: six at most are held, one is being filled.
        assert!(rows.allocated() <= 7 * 8, "{}", rows.allocated());
    }

    #[test]
    fn rows_in_one_block_are_one_piece() {
        let mut rows = Rows::new(RowOrder::from_top(8), 2, 4, 0);
        rows.grow(4).copy_from_slice(&[0, 0, 1, 1, 2, 2, 3, 3]);
        rows.grow(4).fill(9);
        let of = |numbers: &[u32]| numbers.iter().map(|&y| rows.held(y)).collect::<Vec<_>>();
        assert_eq!(Row::joined(&of(&[1, 2, 3])), Some(&[1, 1, 2, 2, 3, 3][..]));
        assert_eq!(Row::joined(&of(&[2, 2, 3])), None);
        assert_eq!(Row::joined(&of(&[3, 4])), None);
        assert_eq!(Row::joined(&of(&[1, 3])), None);
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
