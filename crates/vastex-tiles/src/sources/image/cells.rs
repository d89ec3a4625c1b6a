//! Which parts of coarser levels are kept: those of the coarsest levels for good, since each of their texels
//! is made of many; of the finer ones those that were used last.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rustc_hash::FxHashMap;

use crate::ground::sync::lock;

/// Texels along a side of a cell; those at the right and lower edges of a level have fewer.
pub(super) const SIDE: u32 = 256;

/// A part of a level that is made at once: column and row of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct CellPos {
    pub(super) level: u8,
    pub(super) x: u32,
    pub(super) y: u32,
}

/// The texels of a cell, row by row.
pub(super) type Cell = Arc<[u8]>;

/// The cells that are kept, within a number of bytes.
pub(super) struct Cells {
    /// The finest level whose cells are kept for good.
    lasting_from: u8,
    /// Bytes of cells of finer levels that are kept.
    passing_bytes: u64,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    lasting: FxHashMap<CellPos, Cell>,
    /// With the time of their last use, by which `by_use` finds them.
    passing: FxHashMap<CellPos, (Cell, u64)>,
    by_use: BTreeMap<u64, CellPos>,
    passing_bytes: u64,
    time: u64,
}

impl Cells {
    /// Room for `most` bytes of levels that take `level_bytes`, the finest first. Levels that take half of
    /// the room together are kept for good, as many as that are.
    pub(super) fn new(level_bytes: &[u64], most: u64) -> Cells {
        let (mut lasting_bytes, mut lasting_from) = (0u64, level_bytes.len());
        for (level, bytes) in level_bytes.iter().enumerate().rev() {
            let more = lasting_bytes.saturating_add(*bytes);
            if more > most / 2 {
                break;
            }
            (lasting_bytes, lasting_from) = (more, level);
        }
        Cells {
            lasting_from: lasting_from as u8,
            passing_bytes: most - lasting_bytes,
            kept: Mutex::default(),
        }
    }

    /// A cell, if it is kept. Counts as a use.
    pub(super) fn get(&self, pos: CellPos) -> Option<Cell> {
        let kept = &mut *lock(&self.kept);
        if pos.level >= self.lasting_from {
            return kept.lasting.get(&pos).cloned();
        }
        let (cell, used) = kept.passing.get_mut(&pos)?;
        kept.time += 1;
        kept.by_use.remove(used);
        kept.by_use.insert(kept.time, pos);
        *used = kept.time;
        Some(cell.clone())
    }

    /// Keeps a cell, and drops those of fine levels that were not used for the longest time, as many as must
    /// go for it.
    pub(super) fn insert(&self, pos: CellPos, cell: &Cell) {
        let kept = &mut *lock(&self.kept);
        if pos.level >= self.lasting_from {
            kept.lasting.insert(pos, cell.clone());
            return;
        }
        let bytes = cell.len() as u64;
        if kept.passing.contains_key(&pos) || bytes > self.passing_bytes {
            return;
        }
        while kept.passing_bytes + bytes > self.passing_bytes {
            let Some((_, oldest)) = kept.by_use.pop_first() else { break };
            kept.passing_bytes -= kept.passing.remove(&oldest).map_or(0, |(cell, _)| cell.len() as u64);
        }
        kept.time += 1;
        kept.passing_bytes += bytes;
        kept.by_use.insert(kept.time, pos);
        kept.passing.insert(pos, (cell.clone(), kept.time));
    }

    /// Bytes of the cells that are kept.
    pub(super) fn bytes(&self) -> u64 {
        let kept = lock(&self.kept);
        let lasting: u64 = kept.lasting.values().map(|cell| cell.len() as u64).sum();
        lasting + kept.passing_bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(bytes: usize) -> Cell {
        vec![0; bytes].into()
    }

    #[test]
    fn coarse_levels_stay_and_fine_ones_go_by_their_last_use() {
        let cells = Cells::new(&[1000, 250, 60, 20], 200);
        assert_eq!((cells.lasting_from, cells.passing_bytes), (2, 120));
        let at = |level, x| CellPos { level, x, y: 0 };
        cells.insert(at(3, 0), &cell(20));
        cells.insert(at(2, 0), &cell(60));
        for x in 0..3 {
            cells.insert(at(1, x), &cell(40));
        }
        assert!(cells.get(at(1, 0)).is_some());
        cells.insert(at(1, 3), &cell(40));
        let there: Vec<u32> = (0..4).filter(|&x| cells.get(at(1, x)).is_some()).collect();
        assert_eq!(there, [0, 2, 3]);
        assert!(cells.get(at(2, 0)).is_some() && cells.get(at(3, 0)).is_some());
        cells.insert(at(0, 0), &cell(121));
        assert_eq!(cells.bytes(), 200);
    }
}
