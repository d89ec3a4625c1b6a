//! The texels of a row as numbers that can be mixed, and what was mixed as texels again.
//!
//! Where a value stands for no data, a texel that has it weighs nothing: each texel has one number more, its
//! weight, and sums are divided by the weights of what is known. A texel of which nothing is known is without
//! data again, and so, with kernels that have weights below zero, is one of which less than half is known,
//! since what they make of less may lie far outside.

use vastex_core::LayerFormat;

use super::{Kernel, LayerFilter, Meaning};
use crate::texels::missing::Missing;
use crate::texels::texel::{Light, decode, encode};

/// How near to 1 weights come to where all is known.
const NEAR: f32 = 1e-5;

/// What values mean and which are without data, in one format.
#[derive(Clone, Copy)]
pub(crate) struct Mixing {
    format: LayerFormat,
    meaning: Meaning,
    missing: Option<Missing>,
    pub(super) mix: Mix,
    /// What weights must exceed.
    least: f32,
}

/// How numbers are put together.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Mix {
    Sum,
    Min,
    Max,
}

impl Mixing {
    pub(crate) fn new(filter: LayerFilter, format: LayerFormat) -> Mixing {
        let mix = match filter.kernel {
            Kernel::Min => Mix::Min,
            Kernel::Max => Mix::Max,
            _ => Mix::Sum,
        };
        let is_signed = filter.kernel.weights(2).each.iter().any(|weight| *weight < 0.0);
        Mixing {
            format,
            meaning: filter.meaning,
            missing: filter.nodata.map(|value| Missing::of_layer(format, value)),
            mix,
            least: if is_signed { 0.5 } else { 0.0 },
        }
    }

    /// Bytes of a texel.
    pub(super) fn texel_bytes(&self) -> usize {
        self.format.texel_bytes()
    }

    /// Numbers of a texel, 1 to 5.
    pub(crate) fn channels(&self) -> usize {
        self.meaning.channels(self.format) + usize::from(self.missing.is_some())
    }

    /// The texels of a row, ready to be mixed.
    pub(crate) fn prepared(&self, row: &[u8]) -> Vec<f32> {
        let plain = self.prepared_values(row);
        let Some(missing) = self.missing else { return plain };
        let channels = self.meaning.channels(self.format);
        let (none, weight) = match self.mix {
            Mix::Sum => (0.0, 1.0),
            // What is known is the least, and the most, of the weights that there are.
            Mix::Min => (f32::INFINITY, -1.0),
            Mix::Max => (f32::NEG_INFINITY, 1.0),
        };
        let mut values = Vec::with_capacity(plain.len() / channels * (channels + 1));
        for (values_of, texel) in plain.chunks_exact(channels).zip(row.chunks_exact(missing.texel_bytes())) {
            match missing.is(texel) {
                true => {
                    values.extend(std::iter::repeat_n(none, channels));
                    values.push(0.0);
                }
                false => {
                    values.extend_from_slice(values_of);
                    values.push(weight);
                }
            }
        }
        values
    }

    /// A row of texels, from what was mixed.
    pub(crate) fn finished(&self, mixed: &[f32], row: &mut [u8]) {
        let Some(missing) = self.missing else { return self.finished_values(mixed, row) };
        let channels = self.meaning.channels(self.format);
        let is_known = |weight: f32| match self.mix {
            Mix::Sum => weight > self.least,
            Mix::Min | Mix::Max => weight != 0.0,
        };
        let mut values = Vec::with_capacity(mixed.len() / (channels + 1) * channels);
        for texel in mixed.chunks_exact(channels + 1) {
            let (of_texel, weight) = (&texel[..channels], texel[channels]);
            match (self.mix, is_known(weight)) {
                (_, false) => values.extend(std::iter::repeat_n(0.0, channels)),
                (Mix::Sum, _) if (weight - 1.0).abs() > NEAR => {
                    values.extend(of_texel.iter().map(|value| value / weight));
                }
                _ => values.extend_from_slice(of_texel),
            }
        }
        self.finished_values(&values, row);
        for (texel, mixed) in
            row.chunks_exact_mut(missing.texel_bytes()).zip(mixed.chunks_exact(channels + 1))
        {
            match is_known(mixed[channels]) {
                true => missing.step_off(texel),
                false => missing.write(texel),
            }
        }
    }

    fn light(&self) -> Light {
        if self.meaning == Meaning::LinearColor { Light::Linear } else { Light::Stored }
    }

    fn prepared_values(&self, row: &[u8]) -> Vec<f32> {
        let (format, meaning) = (self.format, self.meaning);
        let texels = row.len() / format.texel_bytes();
        let mut values = vec![0.0; texels * format.channels()];
        decode(format, self.light(), row, &mut values);
        if meaning == Meaning::Stored {
            return values;
        }
        let mut mixed = vec![0.0; texels * meaning.channels(format)];
        meaning.prepare(format, &values, &mut mixed);
        mixed
    }

    fn finished_values(&self, mixed: &[f32], row: &mut [u8]) {
        let (format, meaning) = (self.format, self.meaning);
        if meaning == Meaning::Stored {
            return encode(format, self.light(), mixed, row);
        }
        let mut values = vec![0.0; row.len() / format.texel_bytes() * format.channels()];
        meaning.finish(format, mixed, &mut values);
        encode(format, self.light(), &values, row);
    }
}
