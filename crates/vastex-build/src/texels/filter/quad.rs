//! Four texels made one, in integers: a row of a level from two rows of the next finer one, as that is
//! stored.
//!
//! - Channels of 8 or 16 bits: the mean of four values, halves rounded up, every channel by itself.
//! - Linear colour: alpha is such a mean; the colours are weighted by alpha, halves rounded up. Where all
//!   four texels are transparent, their colours count alike, so that colour under transparency survives.
//! - sRGB colour: as linear colour, on values decoded to 16 bits and rounded; the mean is encoded to the
//!   nearest of the 256 values.
//! - Majority: the texel that is met most often, but none without data while there is another; of several the
//!   smallest, its bytes read as a little-endian number.
//!
//! Address modes are no business of this file: its rows have an even number of texels, the odd edge folded
//! already.

use vastex_core::LayerFormat;

use super::{Kernel, LayerFilter, Meaning};
use crate::texels::missing::Missing;
use crate::texels::srgb::SRGB;

/// How one texel is made from four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quad {
    /// So many 8-bit channels, each by itself.
    Mean8 { channels: usize },
    /// So many 16-bit channels, each by itself.
    Mean16 { channels: usize },
    /// Four channels, linear, weighted by the fourth.
    LinearColor,
    /// Four channels, three of them sRGB-encoded, weighted by the fourth.
    SrgbColor,
    /// The most frequent of the texels, of so many bytes.
    Majority { bytes: usize, missing: Option<Missing> },
}

impl Quad {
    /// The integer arithmetic of a filter, where there is one.
    pub(super) fn new(filter: LayerFilter, format: LayerFormat) -> Option<Quad> {
        use LayerFormat::{R8, R16, Rg8, Rgba8, Rgba8Srgb, Rgba16};
        match (filter.kernel, filter.meaning, format) {
            (Kernel::Majority, ..) => {
                let missing = filter.nodata.map(|value| Missing::of_layer(format, value));
                Some(Quad::Majority { bytes: format.texel_bytes(), missing })
            }
            _ if filter.nodata.is_some() => None,
            (Kernel::Box, Meaning::Stored, R8 | Rg8 | Rgba8 | Rgba8Srgb) => {
                Some(Quad::Mean8 { channels: format.channels() })
            }
            (Kernel::Box, Meaning::Stored, R16 | Rgba16) => {
                Some(Quad::Mean16 { channels: format.channels() })
            }
            (Kernel::Box, Meaning::LinearColor, Rgba8) => Some(Quad::LinearColor),
            (Kernel::Box, Meaning::LinearColor, Rgba8Srgb) => Some(Quad::SrgbColor),
            _ => None,
        }
    }

    /// Fills `coarse` with the means of 2x2 texels; `upper` and `lower` hold twice as many texels as it.
    pub(crate) fn row(self, coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
        match self {
            Quad::Mean8 { channels: 1 } => mean_of_one(coarse, upper, lower),
            Quad::Mean8 { channels: 2 } => mean8::<2, 4>(coarse, upper, lower),
            Quad::Mean8 { .. } => mean_of_four(coarse, upper, lower),
            Quad::Mean16 { channels: 1 } => mean::<2, 1>(coarse, upper, lower, mean16),
            Quad::Mean16 { .. } => mean::<2, 4>(coarse, upper, lower, mean16),
            Quad::LinearColor => color(coarse, upper, lower, u32::from, |mean| mean as u8),
            Quad::SrgbColor => {
                #[cfg(target_arch = "x86_64")]
                if super::wide::srgb_means(coarse, upper, lower, srgb_color) {
                    return;
                }
                srgb_color(coarse, upper, lower);
            }
            Quad::Majority { bytes: 1, missing } => majority::<1>(coarse, upper, lower, missing),
            Quad::Majority { bytes: 2, missing } => majority::<2>(coarse, upper, lower, missing),
            Quad::Majority { bytes: 4, missing } => majority::<4>(coarse, upper, lower, missing),
            Quad::Majority { missing, .. } => majority::<8>(coarse, upper, lower, missing),
        }
    }
}

/// Texels of `B` bytes.
fn majority<const B: usize>(coarse: &mut [u8], upper: &[u8], lower: &[u8], missing: Option<Missing>) {
    let number = |texel: &[u8; B]| texel.iter().rev().fold(0u64, |n, &byte| n << 8 | u64::from(byte));
    let (upper, lower) = (upper.as_chunks::<B>().0, lower.as_chunks::<B>().0);
    let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
    for (to, (&[a, b], &[c, d])) in coarse.as_chunks_mut::<B>().0.iter_mut().zip(pairs) {
        let four = [a, b, c, d];
        let count = |texel: &[u8; B]| four.iter().filter(|other| *other == texel).count();
        let is_known = |texel: &[u8; B]| missing.is_none_or(|missing| !missing.is(texel));
        let better = |best: [u8; B], next: [u8; B]| {
            if is_known(&best) != is_known(&next) {
                return if is_known(&next) { next } else { best };
            }
            let (of_best, of_next) = (count(&best), count(&next));
            let wins = of_next > of_best || of_next == of_best && number(&next) < number(&best);
            if wins { next } else { best }
        };
        *to = [b, c, d].into_iter().fold(a, better);
    }
}

/// Of eight bytes in a word those at even places, each with room for a sum.
const EVEN: u64 = 0x00ff_00ff_00ff_00ff;
/// For each of them two, by which a sum of four values is rounded.
const TWOS: u64 = 0x0002_0002_0002_0002;

/// One channel, four texels at a time.
fn mean_of_one(coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
    let sum = |&pairs: &[u8; 8]| (u64::from_le_bytes(pairs) & EVEN) + (u64::from_le_bytes(pairs) >> 8 & EVEN);
    let (fours, last) = coarse.as_chunks_mut::<4>();
    let ((upper, last_upper), (lower, last_lower)) = (upper.as_chunks(), lower.as_chunks());
    for (to, (a, b)) in fours.iter_mut().zip(upper.iter().zip(lower)) {
        let [v, _, w, _, x, _, y, _] = ((sum(a) + sum(b) + TWOS) >> 2).to_le_bytes();
        *to = [v, w, x, y];
    }
    mean8::<1, 2>(last, last_upper, last_lower);
}

/// Four channels, two of them at a time.
fn mean_of_four(coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
    let pairs = upper.as_chunks().0.iter().zip(lower.as_chunks().0);
    for (to, (&a, &b)) in coarse.as_chunks_mut::<4>().0.iter_mut().zip(pairs) {
        let (a, b) = (u64::from_le_bytes(a), u64::from_le_bytes(b));
        // The two texels of a row stand in the two halves of a word.
        let mean = |sums: u64| ((sums + (sums >> 32) + TWOS) >> 2) & EVEN;
        let (even, odd) = (mean((a & EVEN) + (b & EVEN)), mean((a >> 8 & EVEN) + (b >> 8 & EVEN)));
        *to = ((even | odd << 8) as u32).to_le_bytes();
    }
}

fn mean8<const C: usize, const PAIR: usize>(coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
    let pairs = upper.as_chunks::<PAIR>().0.iter().zip(lower.as_chunks::<PAIR>().0);
    for (to, (a, b)) in coarse.as_chunks_mut::<C>().0.iter_mut().zip(pairs) {
        *to = std::array::from_fn(|c| {
            let sum = u16::from(a[c]) + u16::from(a[c + C]) + u16::from(b[c]) + u16::from(b[c + C]);
            ((sum + 2) >> 2) as u8
        });
    }
}

/// Channels of `B` bytes each, `C` of them in a texel.
fn mean<const B: usize, const C: usize>(
    coarse: &mut [u8],
    upper: &[u8],
    lower: &[u8],
    mean: impl Fn([[u8; B]; 4]) -> [u8; B],
) {
    let (upper, lower) = (upper.as_chunks::<B>().0, lower.as_chunks::<B>().0);
    for (i, to) in coarse.as_chunks_mut::<B>().0.iter_mut().enumerate() {
        let first = i / C * 2 * C + i % C;
        *to = mean([upper[first], upper[first + C], lower[first], lower[first + C]]);
    }
}

fn mean16(four: [[u8; 2]; 4]) -> [u8; 2] {
    let sum: u32 = four.iter().map(|&v| u32::from(u16::from_le_bytes(v))).sum();
    (((sum + 2) >> 2) as u16).to_le_bytes()
}

fn srgb_color(coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
    let srgb = &*SRGB;
    let decode = |v| u32::from(srgb.linear_from_srgb[usize::from(v)]);
    color(coarse, upper, lower, decode, |mean| srgb.srgb_from_linear[mean as u16 as usize]);
}

/// Where the alphas of two texels stand in a word.
const ALPHAS: u64 = 0xff00_0000_ff00_0000;

/// Four channels; `decode` a stored colour value and `encode` a mean of decoded ones.
#[inline(always)]
fn color(
    coarse: &mut [u8],
    upper: &[u8],
    lower: &[u8],
    decode: impl Fn(u8) -> u32,
    encode: impl Fn(u32) -> u8,
) {
    let pairs = upper.as_chunks::<8>().0.iter().zip(lower.as_chunks::<8>().0);
    for (to, (upper, lower)) in coarse.as_chunks_mut::<4>().0.iter_mut().zip(pairs) {
        // Two texels are a word, from which channels are taken by shifts: every value is one byte to load and
        // one to look up otherwise, and this loop does little but load.
        let [a, b] = [upper, lower].map(|two| u64::from_le_bytes(*two));
        if a == b && a == a.rotate_left(32) {
            // Four of one kind are that one, which water and sky mostly are.
            *to = (a as u32).to_le_bytes();
        } else if a & b & ALPHAS == ALPHAS {
            let mean = |c: u32| {
                let [a, b] =
                    [a, b].map(|two| decode((two >> (8 * c)) as u8) + decode((two >> (32 + 8 * c)) as u8));
                u32::from(encode((a + b + 2) >> 2)) << (8 * c)
            };
            *to = (mean(0) | mean(1) | mean(2) | 0xff << 24).to_le_bytes();
        } else {
            *to = weighted_color([*upper, *lower], &decode, &encode);
        }
    }
}

/// Of two texels and two below them, whose colours count as much as they are opaque.
fn weighted_color([a, b]: [[u8; 8]; 2], decode: impl Fn(u8) -> u32, encode: impl Fn(u32) -> u8) -> [u8; 4] {
    let alphas = [a[3], a[7], b[3], b[7]].map(u32::from);
    let alpha: u32 = alphas.iter().sum();
    let (weights, total) = if alpha == 0 { ([1; 4], 4) } else { (alphas, alpha) };
    let mean = |c: usize| {
        let values = [a[c], a[c + 4], b[c], b[c + 4]].map(&decode);
        let sum: u32 = values.iter().zip(&weights).map(|(v, w)| v * w).sum();
        encode((sum + total / 2) / total)
    };
    [mean(0), mean(1), mean(2), ((alpha + 2) >> 2) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(name: &str, format: LayerFormat) -> Quad {
        Quad::new(name.parse().unwrap(), format).unwrap()
    }

    #[test]
    fn the_most_frequent_texel_wins_then_the_smallest() {
        for (four, expected) in [([7, 3, 3, 9], 3), ([9, 2, 9, 2], 2), ([8, 5, 6, 7], 5), ([4, 4, 4, 1], 4)] {
            let mut out = [0; 1];
            quad("majority", LayerFormat::R8).row(&mut out, &four[..2], &four[2..]);
            assert_eq!(out, [expected]);
            let mut out = [0; 2];
            let wide = four.map(|v| (u16::from(v) * 256).to_le_bytes());
            quad("majority", LayerFormat::R16).row(&mut out, &wide[..2].concat(), &wide[2..].concat());
            assert_eq!(u16::from_le_bytes(out), u16::from(expected) * 256);
        }
    }

    #[test]
    fn means_round_halves_up() {
        let mut out = [0; 1];
        Quad::Mean8 { channels: 1 }.row(&mut out, &[0, 1], &[1, 0]);
        assert_eq!(out, [1]);
        let rows = [0u32, 7].map(|n| (0..88 * 4).map(|i| (i * i * 31 + n * i) as u8).collect::<Vec<u8>>());
        for channels in [1, 2, 4] {
            let mut out = vec![0; 44 * channels - channels];
            let row = |n: usize| &rows[n][..2 * out.len()];
            let (upper, lower) = (row(0), row(1));
            Quad::Mean8 { channels }.row(&mut out, upper, lower);
            for (i, &mean) in out.iter().enumerate() {
                let at = i / channels * 2 * channels + i % channels;
                let sum = [upper, lower].map(|row| u32::from(row[at]) + u32::from(row[at + channels]));
                assert_eq!(u32::from(mean), (sum[0] + sum[1] + 2) / 4, "{channels} channels, {i}");
            }
        }
        let mut out = [0; 2];
        Quad::Mean16 { channels: 1 }.row(&mut out, &[0xff, 0xff, 0xff, 0xff], &[0xff, 0xff, 0xfd, 0xff]);
        assert_eq!(u16::from_le_bytes(out), 0xffff);
    }

    #[test]
    fn black_and_white_mix_to_half_the_light() {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let (upper, lower) = ([black, white].concat(), [white, black].concat());
        for (filter, expected) in [
            (quad("box-linear", LayerFormat::Rgba8Srgb), 188),
            (quad("box", LayerFormat::Rgba8Srgb), 128),
            (quad("box-linear", LayerFormat::Rgba8), 128),
        ] {
            let mut out = [0; 4];
            filter.row(&mut out, &upper, &lower);
            assert_eq!(out, [expected, expected, expected, 255]);
        }
    }

    #[test]
    fn four_of_one_kind_are_that_one() {
        for value in 0..=255u8 {
            for alpha in [0, 1, 128, 255] {
                let texel = [value, 255 - value, value / 2, alpha];
                let row = [texel; 2].concat();
                // One that differs by nothing but a transparent texel goes the long way.
                for filter in [Quad::LinearColor, Quad::SrgbColor] {
                    let mut out = [0; 4];
                    filter.row(&mut out, &row, &row);
                    assert_eq!(out, texel);
                    let odd = [texel, [7, 7, 7, 0]].concat();
                    filter.row(&mut out, &row, &odd);
                    assert!(alpha == 0 || out[..3] == texel[..3], "{out:?} {texel:?}");
                }
            }
        }
    }

    #[test]
    fn every_channel_of_opaque_texels_is_the_mean_of_its_own_four() {
        let byte = |i: u32| (i.wrapping_mul(2_654_435_761) >> 23) as u8;
        let row =
            |from: u32| (from..).map(byte).zip(0..4 * 600).map(|(v, at)| if at % 4 == 3 { 255 } else { v });
        let [upper, lower]: [Vec<u8>; 2] = [row(0).collect(), row(5000).collect()];
        for (filter, srgb) in [(Quad::SrgbColor, true), (Quad::LinearColor, false)] {
            let mut out = vec![0; 4 * 300];
            filter.row(&mut out, &upper, &lower);
            for (i, &stored) in out.iter().enumerate() {
                let first = i / 4 * 8 + i % 4;
                let four = [upper[first], upper[first + 4], lower[first], lower[first + 4]].map(usize::from);
                let light = |v: usize| if srgb { u32::from(SRGB.linear_from_srgb[v]) } else { v as u32 };
                let mean = (four.into_iter().map(light).sum::<u32>() + 2) / 4;
                let expected = if srgb { SRGB.srgb_from_linear[mean as usize] } else { mean as u8 };
                assert_eq!(stored, if i % 4 == 3 { 255 } else { expected }, "{filter:?} {i}");
            }
        }
    }

    /// Wherever the processor makes several at once: rows of every length, every value, and texels that are
    /// not opaque between others.
    #[test]
    fn means_of_srgb_colours_are_the_same_however_many_are_made_at_once() {
        let byte = |i: u32| (i.wrapping_mul(2_654_435_761) >> 13) as u8;
        for texels in (0..40).chain([1000]) {
            for every in [1, 2, 5, 23, 1000] {
                // Alphas of most texels are 255, of every so many-th what comes.
                let value = |at: u32| match at % 4 == 3 && at / 4 % every != every / 2 {
                    true => 255,
                    false => byte(at + 77 * every),
                };
                let row = |from: u32| (from..from + 8 * texels).map(value).collect::<Vec<u8>>();
                let (upper, lower) = (row(0), row(4000));
                let [mut at_once, mut one_by_one] =
                    [vec![1; 4 * texels as usize], vec![2; 4 * texels as usize]];
                Quad::SrgbColor.row(&mut at_once, &upper, &lower);
                srgb_color(&mut one_by_one, &upper, &lower);
                assert_eq!(at_once, one_by_one, "{texels} texels, every {every}");
            }
        }
    }

    /// All pairs of values, two of each, and each value beside black.
    #[test]
    fn every_two_values_have_one_mean() {
        let row = |of: fn(u8, u8) -> u8| {
            let pairs = (0..=255u8).flat_map(|a| (0..=255u8).map(move |b| (a, b)));
            pairs.flat_map(|(a, b)| [of(a, b), of(b, a), of(a, 0), 255]).collect::<Vec<u8>>()
        };
        let (upper, lower) = (row(|a, _| a), row(|_, b| b));
        let [mut at_once, mut one_by_one] = [vec![0; upper.len() / 2], vec![0; upper.len() / 2]];
        Quad::SrgbColor.row(&mut at_once, &upper, &lower);
        srgb_color(&mut one_by_one, &upper, &lower);
        assert!(at_once == one_by_one);
    }

    #[test]
    fn transparent_texels_do_not_bleed_and_keep_their_own_colour() {
        let mut out = [0; 4];
        let filter = Quad::LinearColor;
        filter.row(&mut out, &[[200, 0, 0, 255], [0, 99, 0, 0]].concat(), &[[0, 99, 0, 0]; 2].concat());
        assert_eq!(out, [200, 0, 0, 64]);
        filter.row(&mut out, &[[8, 0, 0, 0]; 2].concat(), &[[4, 0, 0, 0]; 2].concat());
        assert_eq!(out, [6, 0, 0, 0]);
    }
}
