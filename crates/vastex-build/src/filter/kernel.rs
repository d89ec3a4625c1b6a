//! Kernels: the weights of the texels along one axis that make one of a coarser level.
//!
//! Each is given for a factor of two. Stretched to another factor, a box, Gauss or sharpening kernel of even size repeats
//! its weights, one of odd size is drawn with straight lines between them, and a windowed sinc is evaluated anew. The
//! weights' sum is always 1.

use std::f64::consts::PI;

/// How far a texel of a coarser level looks, and how it weighs what it sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// The mean of the texels that it covers.
    #[default]
    Box,
    /// 4x4 texels: 1, 3, 3, 1 along each axis. Softer than a box, no stairs.
    Gauss4,
    /// 4x4 texels: -1, 5, 5, -1. A little sharper than a box.
    Sharpen4,
    /// 3x3 texels around one that keeps its position: 1, 2, 1.
    Gauss3,
    /// 5x5 texels around one that keeps its position: -1, 2, 6, 2, -1.
    Sharpen5,
    /// Sinc under a Kaiser window (alpha 4), 12x12 texels.
    Kaiser,
    /// Sinc under its own main lobe, 12x12 texels.
    Lanczos,
    /// The smallest value of the four texels that it covers, each channel by itself.
    Min,
    /// The largest value of the four.
    Max,
    /// The texel that is met most often among the four; of several the smallest, its bytes read as a little-endian number.
    Majority,
    /// The first of the four texels.
    Nearest,
}

/// The weights of texels side by side: texel `factor * i + first` is the first that texel `i` of the coarser level is made of.
pub(crate) struct Taps {
    pub(crate) first: i64,
    pub(crate) weights: Vec<f64>,
}

/// Texels of the coarser level from the middle of a windowed sinc to its end.
const SINC_RADIUS: f64 = 3.0;
/// How steep the Kaiser window is.
const KAISER_ALPHA: f64 = 4.0;

impl Kernel {
    /// Every kernel.
    pub const ALL: [Kernel; 11] = {
        use Kernel::*;
        [Box, Gauss4, Sharpen4, Gauss3, Sharpen5, Kaiser, Lanczos, Min, Max, Majority, Nearest]
    };

    /// The name in help texts and in names of filters.
    pub const fn name(self) -> &'static str {
        match self {
            Kernel::Box => "box",
            Kernel::Gauss4 => "gauss4",
            Kernel::Sharpen4 => "sharpen4",
            Kernel::Gauss3 => "gauss3",
            Kernel::Sharpen5 => "sharpen5",
            Kernel::Kaiser => "kaiser",
            Kernel::Lanczos => "lanczos",
            Kernel::Min => "min",
            Kernel::Max => "max",
            Kernel::Majority => "majority",
            Kernel::Nearest => "nearest",
        }
    }

    /// Whether a texel is one of those that it is made of and no mixture. (Two steps of `min` or `max` are the same as one
    /// of twice the factor.)
    pub const fn picks(self) -> bool {
        matches!(self, Kernel::Min | Kernel::Max | Kernel::Majority | Kernel::Nearest)
    }

    /// Whether the kernel has an odd number of texels and so keeps their positions.
    pub const fn is_odd(self) -> bool {
        matches!(self, Kernel::Gauss3 | Kernel::Sharpen5)
    }

    /// The weights for a factor, which is even. Those of kernels that pick are known for a factor of two only.
    pub(crate) fn taps(self, factor: u32) -> Taps {
        match self {
            Kernel::Box | Kernel::Min | Kernel::Max | Kernel::Majority => repeated(&[1.0, 1.0], factor),
            Kernel::Nearest => repeated(&[1.0, 0.0], factor),
            Kernel::Gauss4 => repeated(&[1.0, 3.0, 3.0, 1.0], factor),
            Kernel::Sharpen4 => repeated(&[-1.0, 5.0, 5.0, -1.0], factor),
            Kernel::Gauss3 => drawn(&[1.0, 2.0, 1.0], factor),
            Kernel::Sharpen5 => drawn(&[-1.0, 2.0, 6.0, 2.0, -1.0], factor),
            Kernel::Kaiser => windowed_sinc(factor, |t| {
                bessel_i0(KAISER_ALPHA * (1.0 - t * t).max(0.0).sqrt()) / bessel_i0(KAISER_ALPHA)
            }),
            Kernel::Lanczos => windowed_sinc(factor, sinc),
        }
    }
}

impl Taps {
    fn new(first: i64, mut weights: Vec<f64>) -> Taps {
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        Taps { first, weights }
    }
}

/// An even number of weights, each given to `factor / 2` texels.
fn repeated(weights: &[f64], factor: u32) -> Taps {
    let half = (factor / 2) as usize;
    let first = (1 - weights.len() as i64 / 2) * half as i64;
    Taps::new(first, weights.iter().flat_map(|&weight| std::iter::repeat_n(weight, half)).collect())
}

/// An odd number of weights, `factor / 2` texels apart, with straight lines between them and down to 0 on both sides.
fn drawn(weights: &[f64], factor: u32) -> Taps {
    let half = i64::from(factor / 2);
    let reach = (weights.len() as i64 / 2 + 1) * half - 1;
    let at = |i: i64| usize::try_from(i).ok().and_then(|i| weights.get(i)).copied().unwrap_or(0.0);
    let drawn = (-reach..=reach).map(|texel| {
        let (step, part) = ((texel + reach + 1).div_euclid(half) - 1, (texel + reach + 1).rem_euclid(half));
        let part = part as f64 / half as f64;
        at(step) * (1.0 - part) + at(step + 1) * part
    });
    Taps::new(-reach, drawn.collect())
}

fn windowed_sinc(factor: u32, window: impl Fn(f64) -> f64) -> Taps {
    let radius = SINC_RADIUS * f64::from(factor);
    let count = 2 * radius as i64;
    let weights = (0..count).map(|tap| {
        let x = (tap as f64 + 0.5 - radius) / f64::from(factor);
        sinc(x) * window(x / SINC_RADIUS)
    });
    Taps::new((i64::from(factor) - count) / 2, weights.collect())
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) }
}

/// The modified Bessel function of the first kind and order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for n in 1..64 {
        term *= (x / (2.0 * f64::from(n))).powi(2);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_books() {
        let check = |kernel: Kernel, factor, first, expected: &[f64]| {
            let taps = kernel.taps(factor);
            let sum: f64 = expected.iter().sum();
            let expected: Vec<f64> = expected.iter().map(|weight| weight / sum).collect();
            assert_eq!((taps.first, taps.weights), (first, expected), "{kernel:?} {factor}");
        };
        check(Kernel::Box, 2, 0, &[1.0, 1.0]);
        check(Kernel::Box, 4, 0, &[1.0; 4]);
        check(Kernel::Gauss4, 2, -1, &[1.0, 3.0, 3.0, 1.0]);
        check(Kernel::Gauss4, 4, -2, &[1.0, 1.0, 3.0, 3.0, 3.0, 3.0, 1.0, 1.0]);
        check(Kernel::Gauss3, 2, -1, &[1.0, 2.0, 1.0]);
        check(Kernel::Gauss3, 4, -3, &[1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]);
        check(Kernel::Sharpen5, 2, -2, &[-1.0, 2.0, 6.0, 2.0, -1.0]);
    }

    #[test]
    fn every_kernel_is_symmetric_about_its_middle_and_sums_to_one() {
        for kernel in Kernel::ALL.into_iter().filter(|&kernel| kernel != Kernel::Nearest) {
            for factor in [2, 4, 8, 64] {
                let Taps { first, weights } = kernel.taps(factor);
                let middle = 2 * first + weights.len() as i64 - 1;
                let expected = if kernel.is_odd() { 0 } else { i64::from(factor) - 1 };
                assert_eq!(middle, expected, "{kernel:?} {factor}");
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                for (a, b) in weights.iter().zip(weights.iter().rev()) {
                    assert!((a - b).abs() < 1e-12, "{kernel:?} {factor}");
                }
            }
        }
    }

    #[test]
    fn a_bessel_function_has_its_known_values() {
        assert!((bessel_i0(0.0) - 1.0).abs() < 1e-15);
        assert!((bessel_i0(4.0) - 11.301_921_952_136_33).abs() < 1e-12);
    }
}
