//! What is known of the values of bricks that were read: kept after a brick has left every cache, so that who
//! draws can leap over what would not be seen, and windows can follow percentiles.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rustc_hash::FxHashMap;
use vastex_core::PagePos;

use super::codes::half;
use crate::values::DType;

/// Bins of a histogram.
pub const BINS: usize = 64;
/// Of every so many rows and layers there is the histogram.
const SAMPLED: usize = 4;
/// Bricks that something is kept of: about 300 bytes each, 20 MiB together.
const MOST_BRICKS: usize = 1 << 16;

/// What the values of a brick are, its borders left out.
#[derive(Clone, Debug, PartialEq)]
pub struct BrickStats {
    /// The least stored value that is finite; 0 where none is.
    pub least: f64,
    /// The greatest stored value that is finite; 0 where none is.
    pub most: f64,
    /// How many values are finite.
    pub count: u32,
    /// Of the values of every fourth row of every fourth layer: how many lie in each of 64 equal parts of
    /// what is between the least and the greatest. Where these are the same, all lie in the first. Values
    /// that are not finite lie in none.
    pub histogram: [u32; BINS],
}

/// What is kept, by page; the first to come goes first.
#[derive(Default)]
pub(super) struct Kept {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    by_page: FxHashMap<PagePos, BrickStats>,
    order: VecDeque<PagePos>,
}

impl Kept {
    pub(super) fn put(&self, page: PagePos, stats: BrickStats) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.by_page.insert(page, stats).is_some() {
            return;
        }
        state.order.push_back(page);
        if state.order.len() > MOST_BRICKS
            && let Some(oldest) = state.order.pop_front()
        {
            state.by_page.remove(&oldest);
        }
    }

    pub(super) fn get(&self, page: PagePos) -> Option<BrickStats> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).by_page.get(&page).cloned()
    }
}

/// Rows of values, little-endian, in a box of them.
pub(super) struct Rows<'a> {
    pub(super) values: &'a [u8],
    /// Bytes of a row of the box, and its rows in a layer.
    pub(super) across: usize,
    pub(super) down: usize,
    /// Which bytes of a row, which rows, and which layers are looked at.
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
    pub(super) layers: Range<usize>,
}

impl Rows<'_> {
    /// Hands out every so many rows of every so many layers.
    #[inline(always)]
    fn each(&self, step: usize, mut look: impl FnMut(&[u8])) {
        for z in self.layers.clone().step_by(step) {
            let layer = z * self.down * self.across;
            let Some(layer) = self.values.get(layer..layer + self.down * self.across) else { return };
            for y in self.rows.clone().step_by(step) {
                look(&layer[y * self.across..][self.columns.clone()]);
            }
        }
    }

    /// The first row; `None` if there is none.
    fn first(&self) -> Option<&[u8]> {
        let (y, z) = (self.rows.clone().next()?, self.layers.clone().next()?);
        let row = (z * self.down + y) * self.across;
        self.values.get(row + self.columns.start..row + self.columns.end)
    }
}

/// Of values of all rows the bounds, and of some the histogram.
pub(super) fn of_rows(dtype: DType, rows: &Rows<'_>) -> BrickStats {
    match dtype {
        // Moved to where processors compare many at once: 8 bits without a sign, 16 bits with one.
        DType::Bool | DType::U8 => whole::<_, 1>(rows, 0, |[v]| v),
        DType::I8 => whole::<_, 1>(rows, -0x80, |[v]| v ^ 0x80),
        DType::U16 => whole::<_, 2>(rows, 0x8000, |v| (u16::from_le_bytes(v) ^ 0x8000) as i16),
        DType::I16 => whole::<_, 2>(rows, 0, i16::from_le_bytes),
        DType::U32 => floats::<4>(rows, |v| u32::from_le_bytes(v).into()),
        DType::I32 => floats::<4>(rows, |v| i32::from_le_bytes(v).into()),
        DType::U64 => floats::<8>(rows, |v| u64::from_le_bytes(v) as f64),
        DType::I64 => floats::<8>(rows, |v| i64::from_le_bytes(v) as f64),
        DType::F16 => floats::<2>(rows, |v| half(u16::from_le_bytes(v))),
        DType::F32 => floats::<4>(rows, |v| f32::from_le_bytes(v).into()),
        DType::F64 => floats::<8>(rows, f64::from_le_bytes),
    }
}

/// Values that are looked at beside each other, each of which has bounds of its own: a processor compares
/// many at once as long as none waits for the one before it.
const LANES: usize = 32;
/// Counts beside each other, so that a value that is the same as the one before does not wait for it.
const TABLES: usize = 4;

/// The least and the greatest of values of whole numbers, and how many there are; `None` of none.
fn bounds_of<T: Copy + Ord, const N: usize>(
    rows: &Rows<'_>,
    value: impl Fn([u8; N]) -> T,
) -> Option<(T, T, u32)> {
    let first = value(*rows.first()?.first_chunk::<N>()?);
    let (mut least, mut most) = ([first; LANES], [first; LANES]);
    // By themselves, so that the others stay in registers from row to row.
    let (mut least_of_rest, mut most_of_rest) = (first, first);
    rows.each(1, |row| {
        let (blocks, rest) = row.as_chunks::<N>().0.as_chunks::<LANES>();
        for block in blocks {
            for n in 0..LANES {
                let value = value(block[n]);
                least[n] = least[n].min(value);
                most[n] = most[n].max(value);
            }
        }
        for bytes in rest {
            least_of_rest = least_of_rest.min(value(*bytes));
            most_of_rest = most_of_rest.max(value(*bytes));
        }
    });
    let least = least.into_iter().fold(least_of_rest, T::min);
    let most = most.into_iter().fold(most_of_rest, T::max);
    let count = rows.layers.len() * rows.rows.len() * (rows.columns.len() / N);
    Some((least, most, count as u32))
}

/// Of whole numbers of up to 16 bits, in whole numbers: a stored one is `base` and the value together.
fn whole<T: Copy + Ord + Into<i32>, const N: usize>(
    rows: &Rows<'_>,
    base: i32,
    value: impl Fn([u8; N]) -> T,
) -> BrickStats {
    let mut histogram = [0; BINS];
    let Some((least, most, count)) = bounds_of(rows, &value) else {
        return BrickStats { least: 0.0, most: 0.0, count: 0, histogram };
    };
    let (least, most): (i32, i32) = (least.into(), most.into());
    let span = (most - least).max(1) as u32;
    // Bin n begins at least + n * span / 64; the last has its end.
    let factor = ((BINS as u64) << 32) / u64::from(span) + 1;
    let bin = |bytes: [u8; N]| {
        let above = u64::from((value(bytes).into() - least) as u32);
        ((above * factor) >> 32).min(BINS as u64 - 1) as usize
    };
    if N == 1 {
        // So few values are counted one by one, and then put into bins.
        let counts = counted::<256, N>(rows, |bytes| bytes[0].into());
        for (byte, count) in (0..=u8::MAX).zip(counts).filter(|(_, count)| *count > 0) {
            histogram[bin([byte; N])] += count;
        }
    } else {
        histogram = counted::<BINS, N>(rows, bin);
    }
    BrickStats { least: (base + least).into(), most: (base + most).into(), count, histogram }
}

/// How many of the values that are sampled are of each kind.
fn counted<const KINDS: usize, const N: usize>(
    rows: &Rows<'_>,
    kind: impl Fn([u8; N]) -> usize,
) -> [u32; KINDS] {
    let mut tables = [[0_u32; KINDS]; TABLES];
    rows.each(SAMPLED, |row| {
        let (blocks, rest) = row.as_chunks::<N>().0.as_chunks::<TABLES>();
        for block in blocks {
            for (table, bytes) in tables.iter_mut().zip(block) {
                table[kind(*bytes)] += 1;
            }
        }
        rest.iter().for_each(|bytes| tables[0][kind(*bytes)] += 1);
    });
    std::array::from_fn(|n| tables.iter().map(|table| table[n]).sum())
}

/// Of floats, and of whole numbers of more than 16 bits.
fn floats<const N: usize>(rows: &Rows<'_>, value: impl Fn([u8; N]) -> f64) -> BrickStats {
    const FEW: usize = LANES / 4;
    let (mut least, mut most, mut counts) = ([f64::INFINITY; FEW], [f64::NEG_INFINITY; FEW], [0_u32; FEW]);
    let mut look = |n: usize, bytes: &[u8; N]| {
        let value = value(*bytes);
        let is_finite = value.is_finite();
        least[n] = least[n].min(if is_finite { value } else { f64::INFINITY });
        most[n] = most[n].max(if is_finite { value } else { f64::NEG_INFINITY });
        counts[n] += u32::from(is_finite);
    };
    rows.each(1, |row| {
        let (blocks, rest) = row.as_chunks::<N>().0.as_chunks::<FEW>();
        for block in blocks {
            block.iter().enumerate().for_each(|(n, bytes)| look(n, bytes));
        }
        rest.iter().enumerate().for_each(|(n, bytes)| look(n, bytes));
    });
    let least = least.into_iter().fold(f64::INFINITY, f64::min);
    let most = most.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let count = counts.iter().sum();
    let mut histogram = [0; BINS];
    if count == 0 {
        return BrickStats { least: 0.0, most: 0.0, count, histogram };
    }
    // Halved first: the whole span may be more than a float holds.
    let span = most / 2.0 - least / 2.0;
    rows.each(SAMPLED, |row| {
        let values = row.as_chunks::<N>().0.iter().map(|bytes| value(*bytes));
        for value in values.filter(|value| value.is_finite()) {
            let share = if span > 0.0 { (value / 2.0 - least / 2.0) / span } else { 0.0 };
            histogram[((share * BINS as f64) as usize).min(BINS - 1)] += 1;
        }
    });
    BrickStats { least, most, count, histogram }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(dtype: DType, values: &[u8]) -> BrickStats {
        let across = values.len();
        of_rows(dtype, &Rows { values, across, down: 1, columns: 0..across, rows: 0..1, layers: 0..1 })
    }

    #[test]
    fn bins_are_equal_parts_between_the_least_and_the_greatest() {
        let values: Vec<u8> = (0..640_u16).flat_map(|n| (100 + n).to_le_bytes()).collect();
        let stats = of(DType::U16, &values);
        assert_eq!((stats.least, stats.most, stats.count), (100.0, 739.0, 640));
        assert!(stats.histogram.iter().all(|count| (9..=11).contains(count)), "{:?}", stats.histogram);
        // Every value, by division.
        for span in [1, 2, 63, 64, 65, 1000, 65_535] {
            let values: Vec<u8> = (0..=span as u16).flat_map(u16::to_le_bytes).collect();
            let mut expected = [0; BINS];
            (0..=span).for_each(|n| expected[(n * BINS as u64 / span).min(BINS as u64 - 1) as usize] += 1);
            assert_eq!(of(DType::U16, &values).histogram, expected, "{span}");
        }
    }

    #[test]
    fn what_is_no_number_counts_for_nothing() {
        let values = [1.0_f32, f32::NAN, -3.0, f32::INFINITY, 5.0].map(f32::to_le_bytes).concat();
        let stats = of(DType::F32, &values);
        assert_eq!((stats.least, stats.most, stats.count), (-3.0, 5.0, 3));
        assert_eq!((stats.histogram[0], stats.histogram[32], stats.histogram[63]), (1, 1, 1));
        let none = of(DType::F32, &f32::NAN.to_le_bytes());
        assert_eq!((none.least, none.most, none.count), (0.0, 0.0, 0));
        let wide = [f64::MIN, f64::MAX].map(f64::to_le_bytes).concat();
        assert_eq!(of(DType::F64, &wide).histogram[63], 1);
    }

    #[test]
    fn signs_count() {
        let stats = of(DType::I16, &[-5_i16, 5, 5].map(i16::to_le_bytes).concat());
        assert_eq!((stats.least, stats.most, stats.histogram[0], stats.histogram[63]), (-5.0, 5.0, 1, 2));
        let bytes: Vec<u8> = (-100..=100_i8).map(|v| v as u8).collect();
        let stats = of(DType::I8, &bytes);
        assert_eq!((stats.least, stats.most, stats.count), (-100.0, 100.0, 201));
        let stats = of(DType::U16, &[40_000_u16, 3, 65_535].map(u16::to_le_bytes).concat());
        assert_eq!((stats.least, stats.most), (3.0, 65_535.0));
        let same = of(DType::U8, &[7; 9]);
        assert_eq!((same.least, same.most, same.histogram[0]), (7.0, 7.0, 9));
    }

    #[test]
    fn what_is_kept_has_a_bound() {
        let kept = Kept::default();
        let stats = of(DType::U8, &[1]);
        for n in 0..MOST_BRICKS as u32 + 10 {
            kept.put(PagePos::at(0, [n, 0, 0]), stats.clone());
        }
        assert_eq!(kept.state.lock().unwrap().by_page.len(), MOST_BRICKS);
        assert!(kept.get(PagePos::at(0, [9, 0, 0])).is_none());
        assert_eq!(kept.get(PagePos::at(0, [10, 0, 0])), Some(stats));
    }
}
