//! Texels of a level from those of an ancestor level, by bilinear interpolation of what is stored. Texels
//! without data are left out: where the nearest of the four is one, so is what is made; else what is made is
//! of the others.

use crate::image::PixelFormat;
use crate::texels::missing::{Missing, number as value, store};

/// Along one axis: which texels of the coarse level each fine one lies between.
pub(super) struct Between {
    first: u32,
    len: u32,
    shift: u32,
}

impl Between {
    /// For `len` texels from `first` on, of a level `shift` levels finer.
    pub(super) fn new(first: u32, len: u32, shift: u32) -> Between {
        Between { first, len, shift }
    }

    /// The nearest coarse texel before the middle of fine texel `n`, and how far behind that one's middle it
    /// lies.
    fn tap(&self, n: u32) -> (i64, f32) {
        // In halves of fine texels, counted from the middle of coarse texel 0.
        let (position, coarse) = (2 * i64::from(self.first + n) + 1 - (1 << self.shift), 2i64 << self.shift);
        (position.div_euclid(coarse), position.rem_euclid(coarse) as f32 / coarse as f32)
    }

    /// The first coarse texel that is needed.
    pub(super) fn origin(&self) -> i64 {
        self.tap(0).0
    }

    /// Coarse texels that are needed.
    pub(super) fn count(&self) -> u32 {
        (self.tap(self.len - 1).0 + 2 - self.origin()) as u32
    }
}

/// Fills a rectangle, whose rows are `stride` bytes apart, from the coarse texels that both axes need.
pub(super) fn fill(
    target: &mut [u8],
    stride: usize,
    (format, missing): (PixelFormat, Option<Missing>),
    coarse: &[u8],
    x: &Between,
    y: &Between,
) {
    let (texel, bytes) = (format.texel_bytes(), format.sample().bytes());
    let at = |row: usize, column: usize| &coarse[(row * x.count() as usize + column) * texel..][..texel];
    for (n, row) in (0..y.len).zip(target.chunks_mut(stride)) {
        let (upper, below) = y.tap(n);
        let upper = (upper - y.origin()) as usize;
        for (n, to) in (0..x.len).zip(row.chunks_exact_mut(texel)) {
            let (left, beside) = x.tap(n);
            let left = (left - x.origin()) as usize;
            let four = [at(upper, left), at(upper, left + 1), at(upper + 1, left), at(upper + 1, left + 1)];
            if let Some(missing) = missing.filter(|missing| four.iter().any(|texel| missing.is(texel))) {
                fill_around(to, four, [beside, below], missing);
                continue;
            }
            for (channel, to) in to.chunks_exact_mut(bytes).enumerate() {
                let [a, b, c, d] =
                    four.map(|texel| value(&texel[channel * bytes..][..bytes], format.sample()));
                let (over, under) = (a + (b - a) * beside, c + (d - c) * beside);
                store(to, over + (under - over) * below, format.sample());
            }
        }
    }
}

/// A texel among four of which some are without data: `beside` and `below` say how far it lies from the first
/// column and row.
fn fill_around(to: &mut [u8], four: [&[u8]; 4], [beside, below]: [f32; 2], missing: Missing) {
    let nearest = usize::from(beside >= 0.5) + 2 * usize::from(below >= 0.5);
    if missing.is(four[nearest]) {
        return to.copy_from_slice(four[nearest]);
    }
    let weights =
        [(1.0 - beside) * (1.0 - below), beside * (1.0 - below), (1.0 - beside) * below, beside * below];
    let weights: [f32; 4] = std::array::from_fn(|n| if missing.is(four[n]) { 0.0 } else { weights[n] });
    let sum: f32 = weights.iter().sum();
    let bytes = missing.sample().bytes();
    for (channel, to) in to.chunks_exact_mut(bytes).enumerate() {
        let of = |n: usize| match weights[n] {
            0.0 => 0.0,
            weight => weight / sum * value(&four[n][channel * bytes..][..bytes], missing.sample()),
        };
        store(to, (0..4).map(of).sum(), missing.sample());
    }
    missing.step_off(to);
}

#[cfg(test)]
mod tests {
    use half::f16;
    use vastex_core::NodataValue;

    use super::*;
    use crate::image::Sample;

    #[test]
    fn what_is_without_data_is_left_out() {
        let missing = Missing::of_image(PixelFormat::GREY8, NodataValue::new(0.0));
        let (x, y) = (Between::new(0, 8, 2), Between::new(0, 1, 2));
        let coarse = [20, 100, 0, 250, 20, 100, 0, 250];
        let mut fine = [7; 8];
        fill(&mut fine, 8, (PixelFormat::GREY8, Some(missing)), &coarse, &x, &y);
        // Near the third one nothing is known; beside it there is only the second, and the fourth.
        assert_eq!(fine, [70, 90, 100, 100, 0, 0, 0, 0]);
    }

    #[test]
    fn a_ramp_stays_a_ramp() {
        // Coarse texels -1, 0, 1, 2 of the ramp 100 + 80 n; fine ones are 20 apart, two levels down.
        let (x, y) = (Between::new(0, 8, 2), Between::new(0, 1, 2));
        assert_eq!((x.origin(), x.count(), y.origin(), y.count()), (-1, 4, -1, 2));
        let coarse = [20, 100, 180, 250, 20, 100, 180, 250];
        let mut fine = [0; 8];
        fill(&mut fine, 8, (PixelFormat::GREY8, None), &coarse, &x, &y);
        assert_eq!(fine, [70, 90, 110, 130, 150, 170, 189, 206]);
    }

    #[test]
    fn every_kind_of_sample_is_interpolated() {
        let axis = || Between::new(1, 1, 1);
        for (sample, low, high, expected) in [
            (Sample::U16, vec![0, 16], vec![0, 32], vec![0, 20]),
            (
                Sample::F16,
                f16::ONE.to_le_bytes().to_vec(),
                f16::from_f32(5.0).to_le_bytes().to_vec(),
                f16::from_f32(2.0).to_le_bytes().to_vec(),
            ),
            (
                Sample::F32,
                1f32.to_le_bytes().to_vec(),
                5f32.to_le_bytes().to_vec(),
                2f32.to_le_bytes().to_vec(),
            ),
        ] {
            let coarse = [low.clone(), high.clone(), low, high].concat();
            let mut fine = vec![0; sample.bytes()];
            let format = PixelFormat::GREY8.with_sample(sample);
            fill(&mut fine, sample.bytes(), (format, None), &coarse, &axis(), &axis());
            assert_eq!(fine, expected, "{sample:?}");
        }
    }
}
