//! Box filters: one row of a level from two rows of the next finer one, as that is stored.
//!
//! - Data (`R8`, `RG8`, `R16`), and colour stored as it is: the mean of four values, halves rounded up, every channel
//!   by itself.
//! - Linear colour: alpha is such a mean; the colours are weighted by alpha, halves rounded up. Where all four texels are
//!   transparent, their colours count alike, so that colour under transparency survives.
//! - sRGB colour: as linear colour, on values decoded to 16 bits and rounded; the mean is encoded to the nearest of
//!   the 256 values.
//!
//! Address modes are no business of a filter: its rows have an even number of texels, the odd edge folded already.

use std::sync::LazyLock;

use half::f16;
use vastex_core::LayerFormat;

/// How one texel is made from four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    /// So many 8-bit channels, each by itself.
    Mean8 { channels: usize },
    /// So many 16-bit channels, each by itself.
    Mean16 { channels: usize },
    /// So many channels of 16-bit floats, each by itself.
    MeanHalf { channels: usize },
    /// One channel of 32-bit floats.
    MeanFloat,
    /// Four channels, linear, weighted by the fourth.
    LinearColor,
    /// Four channels, three of them sRGB-encoded, weighted by the fourth.
    SrgbColor,
}

impl Filter {
    /// The filter of a layer. `linear_light` false filters colour as it is stored.
    pub(crate) fn new(format: LayerFormat, linear_light: bool) -> Filter {
        match format.decoded() {
            LayerFormat::Rgba16 => Filter::Mean16 { channels: 4 },
            LayerFormat::R16Float => Filter::MeanHalf { channels: 1 },
            LayerFormat::Rgba16Float => Filter::MeanHalf { channels: 4 },
            LayerFormat::R32Float => Filter::MeanFloat,
            LayerFormat::R8 => Filter::Mean8 { channels: 1 },
            LayerFormat::Rg8 => Filter::Mean8 { channels: 2 },
            LayerFormat::R16 => Filter::Mean16 { channels: 1 },
            LayerFormat::Rgba8 if linear_light => Filter::LinearColor,
            LayerFormat::Rgba8Srgb if linear_light => Filter::SrgbColor,
            _ => Filter::Mean8 { channels: 4 },
        }
    }

    /// What a container calls the filter, from which it can be found again.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Filter::Mean8 { .. } | Filter::Mean16 { .. } | Filter::MeanHalf { .. } | Filter::MeanFloat => {
                "box"
            }
            Filter::LinearColor | Filter::SrgbColor => "box-linear",
        }
    }

    /// The filter of a layer that a container calls `name`; nothing for one that is not known here.
    pub(crate) fn named(format: LayerFormat, name: &str) -> Option<Filter> {
        [true, false].map(|linear| Filter::new(format, linear)).into_iter().find(|f| f.name() == name)
    }

    /// Fills `coarse` with the means of 2x2 texels; `upper` and `lower` hold twice as many texels as it.
    pub(crate) fn row(self, coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
        match self {
            Filter::Mean8 { channels: 1 } => mean8::<1, 2>(coarse, upper, lower),
            Filter::Mean8 { channels: 2 } => mean8::<2, 4>(coarse, upper, lower),
            Filter::Mean8 { .. } => mean8::<4, 8>(coarse, upper, lower),
            Filter::Mean16 { channels: 1 } => mean::<2, 1>(coarse, upper, lower, mean16),
            Filter::Mean16 { .. } => mean::<2, 4>(coarse, upper, lower, mean16),
            Filter::MeanHalf { channels: 1 } => mean::<2, 1>(coarse, upper, lower, mean_half),
            Filter::MeanHalf { .. } => mean::<2, 4>(coarse, upper, lower, mean_half),
            Filter::MeanFloat => mean::<4, 1>(coarse, upper, lower, |four| {
                (four.map(f32::from_le_bytes).iter().sum::<f32>() * 0.25).to_le_bytes()
            }),
            Filter::LinearColor => color(coarse, upper, lower, u32::from, |mean| mean as u8),
            Filter::SrgbColor => {
                let srgb = &*SRGB;
                color(
                    coarse,
                    upper,
                    lower,
                    |v| u32::from(srgb.linear_from_srgb[usize::from(v)]),
                    |mean| srgb.srgb_from_linear[mean as u16 as usize],
                );
            }
        }
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

fn mean_half(four: [[u8; 2]; 4]) -> [u8; 2] {
    let sum: f32 = four.iter().map(|&v| f16::from_le_bytes(v).to_f32()).sum();
    f16::from_f32(sum * 0.25).to_le_bytes()
}

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
    for (to, (a, b)) in coarse.as_chunks_mut::<4>().0.iter_mut().zip(pairs) {
        if a[3] & a[7] & b[3] & b[7] == 255 {
            let mean = |c: usize| {
                encode((decode(a[c]) + decode(a[c + 4]) + decode(b[c]) + decode(b[c + 4]) + 2) >> 2)
            };
            *to = [mean(0), mean(1), mean(2), 255];
        } else {
            let alphas = [a[3], a[7], b[3], b[7]].map(u32::from);
            let alpha: u32 = alphas.iter().sum();
            let (weights, total) = if alpha == 0 { ([1; 4], 4) } else { (alphas, alpha) };
            let mean = |c: usize| {
                let values = [a[c], a[c + 4], b[c], b[c + 4]].map(&decode);
                let sum: u32 = values.iter().zip(&weights).map(|(v, w)| v * w).sum();
                encode((sum + total / 2) / total)
            };
            *to = [mean(0), mean(1), mean(2), ((alpha + 2) >> 2) as u8];
        }
    }
}

/// The transfer curve of sRGB as tables: 8 bits encoded, 16 bits linear.
struct Srgb {
    linear_from_srgb: [u16; 256],
    srgb_from_linear: Box<[u8; 65536]>,
}

static SRGB: LazyLock<Srgb> = LazyLock::new(|| {
    let linear = |s: f64| if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
    let linear_from_srgb = std::array::from_fn(|v| (linear(v as f64 / 255.0) * 65535.0).round() as u16);
    // A value is encoded as v where it lies between what v - 1/2 and v + 1/2 decode to.
    let mut srgb_from_linear = Box::new([0; 65536]);
    let mut start = 0;
    for v in 0..256 {
        let end = if v == 255 { 65536 } else { (linear((v as f64 + 0.5) / 255.0) * 65535.0).ceil() as usize };
        srgb_from_linear[start..end].fill(v as u8);
        start = end;
    }
    Srgb { linear_from_srgb, srgb_from_linear }
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_undoes_decoding_and_never_falls() {
        for v in 0..=255u8 {
            assert_eq!(SRGB.srgb_from_linear[usize::from(SRGB.linear_from_srgb[usize::from(v)])], v);
        }
        assert!(SRGB.srgb_from_linear.is_sorted());
    }

    #[test]
    fn means_round_halves_up() {
        let mut out = [0; 1];
        Filter::Mean8 { channels: 1 }.row(&mut out, &[0, 1], &[1, 0]);
        assert_eq!(out, [1]);
        let mut out = [0; 2];
        Filter::Mean16 { channels: 1 }.row(&mut out, &[0xff, 0xff, 0xff, 0xff], &[0xff, 0xff, 0xfd, 0xff]);
        assert_eq!(u16::from_le_bytes(out), 0xffff);
    }

    #[test]
    fn black_and_white_mix_to_half_the_light() {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let (upper, lower) = ([black, white].concat(), [white, black].concat());
        for (filter, expected) in [
            (Filter::new(LayerFormat::Rgba8Srgb, true), 188),
            (Filter::new(LayerFormat::Rgba8Srgb, false), 128),
            (Filter::new(LayerFormat::Rgba8, true), 128),
        ] {
            let mut out = [0; 4];
            filter.row(&mut out, &upper, &lower);
            assert_eq!(out, [expected, expected, expected, 255]);
        }
    }

    #[test]
    fn transparent_texels_do_not_bleed_and_keep_their_own_colour() {
        let mut out = [0; 4];
        let filter = Filter::LinearColor;
        filter.row(&mut out, &[[200, 0, 0, 255], [0, 99, 0, 0]].concat(), &[[0, 99, 0, 0]; 2].concat());
        assert_eq!(out, [200, 0, 0, 64]);
        filter.row(&mut out, &[[8, 0, 0, 0]; 2].concat(), &[[4, 0, 0, 0]; 2].concat());
        assert_eq!(out, [6, 0, 0, 0]);
    }
}
