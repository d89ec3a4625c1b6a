//! How voxels of a coarser level are made of finer ones: boxes of values, halved along the axes that are
//! named, in whole numbers where values are whole.
//!
//! A side of `n` voxels becomes one of `ceil(n / 2)`, so that voxel `i` is made of `2 i` and `2 i + 1`. Where
//! `n` is odd, the last voxel counts twice, which is the same as leaving out the one that is not there: in
//! means, in the greatest and the least, and in what is most frequent.

mod number;

use number::{F16, Number};

use crate::values::DType;

/// What a voxel of a coarser level is, of the up to eight that it covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reduction {
    /// The mean of the voxels. Of whole numbers, the nearest whole number, halves upwards (-1.5 becomes -1).
    /// Of floats, the sum in 64 bits (along y, then z, then x) divided once; those that are no numbers are
    /// left out, unless none is a number.
    Mean,
    /// The greatest. Floats that are no numbers are left out, unless none is a number.
    Max,
    /// The least. Floats that are no numbers are left out, unless none is a number.
    Min,
    /// The most frequent; of several the one whose bytes, read as a little-endian number without a sign, are
    /// the least. For labels, which are never mixed.
    Majority,
}

impl Reduction {
    /// Every reduction.
    pub const ALL: [Reduction; 4] = [Reduction::Mean, Reduction::Max, Reduction::Min, Reduction::Majority];

    /// The reduction's name in options and metadata.
    pub const fn name(self) -> &'static str {
        match self {
            Reduction::Mean => "mean",
            Reduction::Max => "max",
            Reduction::Min => "min",
            Reduction::Majority => "majority",
        }
    }

    /// How levels are made where nobody says: by the mean, and of labels by the most frequent.
    pub const fn usual(is_labels: bool) -> Reduction {
        if is_labels { Reduction::Majority } else { Reduction::Mean }
    }

    /// Of a [name](Reduction::name).
    pub fn named(name: &str) -> Option<Reduction> {
        Reduction::ALL.into_iter().find(|rule| rule.name() == name)
    }
}

/// The sides of a box once it is reduced: each divided by its factor, rounded up.
pub fn reduced_size(size: [usize; 3], factor: [usize; 3]) -> [usize; 3] {
    std::array::from_fn(|axis| size[axis].div_ceil(factor[axis].max(1)))
}

/// Reduces a box of values. `values` are `size` voxels along x, y and z, little-endian, x fastest, then y,
/// then z; `factor` is 1 or 2 along each axis. Fills `output` with the [reduced](reduced_size) box.
///
/// Layers of `factor[2]` along z are independent of each other, so parts of a box that begin at an even z can
/// be reduced by several threads. `None`, and nothing is written, if a length or a factor does not fit.
pub fn reduce_into(
    dtype: DType,
    rule: Reduction,
    values: &[u8],
    size: [usize; 3],
    factor: [usize; 3],
    output: &mut [u8],
) -> Option<()> {
    let bytes = |size: [usize; 3]| {
        size.iter().try_fold(dtype.bytes(), |product: usize, side| product.checked_mul(*side))
    };
    let fits = factor.iter().all(|factor| matches!(factor, 1 | 2))
        && bytes(size) == Some(values.len())
        && bytes(reduced_size(size, factor)) == Some(output.len());
    if !fits {
        return None;
    }
    let shape = Shape { size, factor };
    match dtype {
        DType::Bool | DType::U8 => shape.reduce::<u8, 1>(rule, values, output),
        DType::I8 => shape.reduce::<i8, 1>(rule, values, output),
        DType::U16 => shape.reduce::<u16, 2>(rule, values, output),
        DType::I16 => shape.reduce::<i16, 2>(rule, values, output),
        DType::U32 => shape.reduce::<u32, 4>(rule, values, output),
        DType::I32 => shape.reduce::<i32, 4>(rule, values, output),
        DType::U64 => shape.reduce::<u64, 8>(rule, values, output),
        DType::I64 => shape.reduce::<i64, 8>(rule, values, output),
        DType::F16 => shape.reduce::<F16, 2>(rule, values, output),
        DType::F32 => shape.reduce::<f32, 4>(rule, values, output),
        DType::F64 => shape.reduce::<f64, 8>(rule, values, output),
    }
    Some(())
}

/// A box, and how it is reduced.
#[derive(Clone, Copy)]
struct Shape {
    size: [usize; 3],
    factor: [usize; 3],
}

/// Voxels that one is made of, at most.
const MOST: usize = 8;

impl Shape {
    fn reduce<T: Number<N>, const N: usize>(self, rule: Reduction, values: &[u8], output: &mut [u8]) {
        let (values, output) = (values.as_chunks::<N>().0, output.as_chunks_mut::<N>().0);
        let [width, height, depth] = self.size;
        let [out_width, out_height, _] = reduced_size(self.size, self.factor);
        if output.is_empty() {
            return;
        }
        let mut sums = vec![T::Sum::default(); width];
        let mut picks = vec![T::default(); width];
        for (n, line) in output.chunks_exact_mut(out_width).enumerate() {
            let (y, z) = (n % out_height * self.factor[1], n / out_height * self.factor[2]);
            // Four rows at most; where the box ends, the last one stands for the one that is not there.
            let mut rows: [&[[u8; N]]; 4] = [&[]; 4];
            let mut count = 0;
            for dz in 0..self.factor[2] {
                for dy in 0..self.factor[1] {
                    let row = (z + dz).min(depth - 1) * height + (y + dy).min(height - 1);
                    rows[count] = &values[row * width..(row + 1) * width];
                    count += 1;
                }
            }
            let rows = &rows[..count];
            match rule {
                Reduction::Mean => self.mean::<T, N>(rows, &mut sums, line),
                Reduction::Max => self.pick::<T, N>(rows, &mut picks, line, T::max_of),
                Reduction::Min => self.pick::<T, N>(rows, &mut picks, line, T::min_of),
                Reduction::Majority => {
                    for (x, value) in line.iter_mut().enumerate() {
                        let (found, count) = self.gather::<T, N>(rows, x);
                        *value = most_frequent(&found[..count]).to_bytes();
                    }
                }
            }
        }
    }

    fn mean<T: Number<N>, const N: usize>(
        self,
        rows: &[&[[u8; N]]],
        sums: &mut [T::Sum],
        line: &mut [[u8; N]],
    ) {
        for (sum, value) in sums.iter_mut().zip(rows[0]) {
            *sum = T::of_bytes(*value).widen();
        }
        for row in &rows[1..] {
            for (sum, value) in sums.iter_mut().zip(*row) {
                *sum = T::add(*sum, T::of_bytes(*value).widen());
            }
        }
        let count = (rows.len() * self.factor[0]) as u32;
        let settle = |x: usize, sum: T::Sum| {
            T::mean(sum, count.trailing_zeros()).unwrap_or_else(|| {
                let (found, count) = self.gather::<T, N>(rows, x);
                T::careful_mean(&found[..count])
            })
        };
        if self.factor[0] == 1 {
            for (x, (value, sum)) in line.iter_mut().zip(sums.iter()).enumerate() {
                *value = settle(x, *sum).to_bytes();
            }
            return;
        }
        let (pairs, rest) = sums.as_chunks::<2>();
        for (x, (value, [left, right])) in line.iter_mut().zip(pairs).enumerate() {
            *value = settle(x, T::add(*left, *right)).to_bytes();
        }
        if let ([last], Some(value)) = (rest, line.last_mut()) {
            *value = settle(pairs.len(), T::add(*last, *last)).to_bytes();
        }
    }

    fn pick<T: Number<N>, const N: usize>(
        self,
        rows: &[&[[u8; N]]],
        picks: &mut [T],
        line: &mut [[u8; N]],
        pick: impl Fn(T, T) -> T,
    ) {
        for (best, value) in picks.iter_mut().zip(rows[0]) {
            *best = T::of_bytes(*value);
        }
        for row in &rows[1..] {
            for (best, value) in picks.iter_mut().zip(*row) {
                *best = pick(*best, T::of_bytes(*value));
            }
        }
        if self.factor[0] == 1 {
            for (value, best) in line.iter_mut().zip(picks.iter()) {
                *value = best.to_bytes();
            }
            return;
        }
        let (pairs, rest) = picks.as_chunks::<2>();
        for (value, [left, right]) in line.iter_mut().zip(pairs) {
            *value = pick(*left, *right).to_bytes();
        }
        if let ([last], Some(value)) = (rest, line.last_mut()) {
            *value = last.to_bytes();
        }
    }

    /// The voxels that voxel `x` of a row is made of, along y, then z, then x, and how many they are.
    fn gather<T: Number<N>, const N: usize>(self, rows: &[&[[u8; N]]], x: usize) -> ([T; MOST], usize) {
        let mut found = [T::default(); MOST];
        let mut count = 0;
        for dx in 0..self.factor[0] {
            let at = (x * self.factor[0] + dx).min(self.size[0] - 1);
            for row in rows {
                found[count] = T::of_bytes(row[at]);
                count += 1;
            }
        }
        (found, count)
    }
}

/// The most frequent value; of several the one with the least bits.
fn most_frequent<T: Number<N>, const N: usize>(values: &[T]) -> T {
    let bits = |value: &T| value.bits();
    let first = bits(&values[0]);
    if values.iter().all(|value| bits(value) == first) {
        return values[0];
    }
    let frequency = |value: &T| values.iter().filter(|other| bits(other) == bits(value)).count();
    let mut best = (values[0], frequency(&values[0]));
    for value in &values[1..] {
        let times = frequency(value);
        if times > best.1 || (times == best.1 && bits(value) < bits(&best.0)) {
            best = (*value, times);
        }
    }
    best.0
}

#[cfg(test)]
mod tests;
