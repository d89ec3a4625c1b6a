//! How many chunks of the finest made level are done, each counted once however often it is made or found.

use rustc_hash::FxHashMap;

use super::MadePos;

/// Chunks along each side of a block of the finest level that has a bit for each.
const BLOCK: u64 = 4;

/// What is done: chunks of the finest level one by one, and of coarser levels as wholes.
#[derive(Default)]
pub(super) struct Done {
    /// A bit for each chunk of the finest level that came by itself, of blocks of which one did.
    finest: FxHashMap<[u64; 3], u64>,
    /// Of chunks of coarser levels how many are done below, and whether they came as wholes.
    coarser: FxHashMap<MadePos, (u64, bool)>,
    count: u64,
}

impl Done {
    /// Chunks of the finest level that are done.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Returns true if a chunk came before, by itself or with one of those `coarser` that it is a part of.
    pub(super) fn has(&self, of: MadePos, coarser: &[MadePos]) -> bool {
        let is_whole = |of: &MadePos| self.coarser.get(of).is_some_and(|(_, is_whole)| *is_whole);
        let (block, bit) = place(of.1);
        let is_marked = of.0 == 0 && self.finest.get(&block).is_some_and(|bits| bits & bit != 0);
        is_marked || is_whole(&of) || coarser.iter().any(is_whole)
    }

    /// Counts a chunk, of which `covered` of the finest level are a part, and tells it to all that it is a
    /// part of, which are `coarser`.
    pub(super) fn add(&mut self, of: MadePos, coarser: &[MadePos], covered: u64) {
        if self.has(of, coarser) {
            return;
        }
        let more = match of.0 {
            0 => {
                let (block, bit) = place(of.1);
                *self.finest.entry(block).or_default() |= bit;
                covered
            }
            _ => {
                let (before, is_whole) = self.coarser.entry(of).or_default();
                *is_whole = true;
                covered.saturating_sub(std::mem::replace(before, covered))
            }
        };
        for of in coarser {
            self.coarser.entry(*of).or_default().0 += more;
        }
        self.count += more;
    }
}

/// The block of a chunk of the finest level, and its bit there.
fn place(at: [u64; 3]) -> ([u64; 3], u64) {
    let [x, y, z] = at.map(|at| at % BLOCK);
    (at.map(|at| at / BLOCK), 1 << ((z * BLOCK + y) * BLOCK + x))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chunks in a row of which every coarser one has two of the level before, four levels of them.
    fn add(done: &mut Done, level: usize, x: u64) -> u64 {
        let coarser: Vec<MadePos> = (level + 1..4).map(|of| (of, [x >> (of - level), 0, 0])).collect();
        done.add((level, [x, 0, 0]), &coarser, 1 << level);
        assert!(done.has((level, [x, 0, 0]), &coarser));
        done.count()
    }

    #[test]
    fn what_comes_again_or_with_a_coarser_one_counts_once() {
        let mut done = Done::default();
        assert_eq!([5, 5, 4, 12, 5].map(|x| add(&mut done, 0, x)), [1, 1, 2, 3, 3]);
        // Chunks 4 to 7, of which two are there; then one of them, and what they are made of.
        assert_eq!([(2, 1), (0, 6), (1, 2), (2, 1)].map(|(level, x)| add(&mut done, level, x)), [5; 4]);
        // All of the first eight, and of the last ones two by two.
        assert_eq!(
            [(3, 0), (1, 6), (1, 7), (2, 3)].map(|(level, x)| add(&mut done, level, x)),
            [9, 10, 12, 12]
        );
        assert_eq!([(2, 2), (3, 1), (0, 0), (0, 15)].map(|(level, x)| add(&mut done, level, x)), [16; 4]);
    }

    #[test]
    fn each_chunk_has_a_bit_of_its_own() {
        let (mut done, side) = (Done::default(), 2 * BLOCK + 1);
        for n in 0..side.pow(3) {
            assert_eq!(done.count(), n);
            done.add((0, [n % side, n / side % side, n / side / side]), &[], 1);
        }
        assert_eq!(done.count(), side.pow(3));
    }
}
