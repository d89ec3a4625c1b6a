//! Any kernel, on any format: along each row in 32-bit floats, then across the rows, rounded once at the end.
//!
//! A texel is the result of the same operations in the same order whoever asks for it, so it depends neither
//! on threads nor on which rows are made together.

use vastex_core::LayerFormat;

use super::mixing::{Mix, Mixing};
use super::{LayerFilter, Weights};

/// A kernel and a meaning, for one format.
pub(crate) struct Separable {
    mixing: Mixing,
    factor: usize,
    weights: Vec<f32>,
}

impl Separable {
    pub(super) fn new(filter: LayerFilter, format: LayerFormat, factor: u32, weights: &Weights) -> Separable {
        let weights = weights.each.iter().map(|&weight| weight as f32).collect();
        Separable { mixing: Mixing::new(filter, format), factor: factor as usize, weights }
    }

    /// Bytes of one texel of a row.
    pub(crate) fn texel_bytes(&self) -> usize {
        self.mixing.texel_bytes()
    }

    /// Values of one texel of a line.
    pub(crate) fn channels(&self) -> usize {
        self.mixing.channels()
    }

    /// `texels` coarse texels along one row, which holds all that they are made of, as floats for
    /// [`Separable::across`].
    pub(crate) fn along(&self, row: &[u8], texels: usize) -> Vec<f32> {
        let prepared = self.mixing.prepared(row);
        let mut line = vec![0.0; texels * self.channels()];
        match self.channels() {
            1 => self.mix_along::<1>(&prepared, &mut line),
            2 => self.mix_along::<2>(&prepared, &mut line),
            3 => self.mix_along::<3>(&prepared, &mut line),
            4 => self.mix_along::<4>(&prepared, &mut line),
            _ => self.mix_along::<5>(&prepared, &mut line),
        }
        line
    }

    fn mix_along<const C: usize>(&self, texels: &[f32], line: &mut [f32]) {
        let (texels, count) = (texels.as_chunks::<C>().0, self.weights.len());
        for (i, to) in line.as_chunks_mut::<C>().0.iter_mut().enumerate() {
            let window = &texels[i * self.factor..][..count];
            *to = match self.mixing.mix {
                Mix::Sum => {
                    let mut sum = [0.0; C];
                    for (texel, weight) in window.iter().zip(&self.weights) {
                        sum = std::array::from_fn(|c| sum[c] + weight * texel[c]);
                    }
                    sum
                }
                Mix::Min => window.iter().fold(window[0], |m, t| std::array::from_fn(|c| m[c].min(t[c]))),
                Mix::Max => window.iter().fold(window[0], |m, t| std::array::from_fn(|c| m[c].max(t[c]))),
            };
        }
    }

    /// One row of the coarser level, from the lines of all rows that it is made of, in their order.
    pub(crate) fn across<'l>(&self, lines: impl Iterator<Item = &'l [f32]>, row: &mut [u8]) {
        let mut mixed = Vec::new();
        for (line, &weight) in lines.zip(&self.weights) {
            if mixed.is_empty() {
                mixed = match self.mixing.mix {
                    Mix::Sum => line.iter().map(|value| weight * value).collect(),
                    Mix::Min | Mix::Max => line.to_vec(),
                };
                continue;
            }
            let pairs = mixed.iter_mut().zip(line);
            match self.mixing.mix {
                Mix::Sum => pairs.for_each(|(sum, value)| *sum += weight * value),
                Mix::Min => pairs.for_each(|(least, value)| *least = least.min(*value)),
                Mix::Max => pairs.for_each(|(most, value)| *most = most.max(*value)),
            }
        }
        self.mixing.finished(&mixed, row);
    }
}
