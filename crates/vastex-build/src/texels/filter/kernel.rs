//! Kernels: the weights of the texels along one axis that make one of a coarser level.
//!
//! Each is given for a factor of two. Stretched to another factor, a box, Gauss or sharpening kernel of even
//! size repeats its weights, one of odd size is drawn with straight lines between them, and a windowed sinc
//! is evaluated anew. The weights' sum is always 1.

use std::f64::consts::PI;

/// How many finer texels a texel of a coarser level is made of, and their weights.
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
    /// The texel that is met most often among the four; of several the smallest, its bytes read as a
    /// little-endian number.
    Majority,
    /// The first of the four texels.
    Nearest,
}

/// The weights of texels side by side: texel `factor * i + first` is the first that texel `i` of the coarser
/// level is made of.
pub(crate) struct Weights {
    pub(crate) first: i64,
    pub(crate) each: Vec<f64>,
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

    /// Returns true if a filtered texel is one of those that it is made of, and no mixture. (Two steps of
    /// `min` or `max` are the same as one of twice the factor.)
    pub const fn picks(self) -> bool {
        matches!(self, Kernel::Min | Kernel::Max | Kernel::Majority | Kernel::Nearest)
    }

    /// Returns true if values that the kernel is meant for may be mixed where they are sampled: not for those
    /// that pick because a mixture would mean nothing.
    pub const fn may_mix(self) -> bool {
        !matches!(self, Kernel::Majority | Kernel::Nearest)
    }

    /// Returns true if the kernel has an odd number of texels and so keeps their positions.
    pub const fn is_odd(self) -> bool {
        matches!(self, Kernel::Gauss3 | Kernel::Sharpen5)
    }

    /// The kernel stretched to a factor, which is even. Those that pick are known for a factor of two only.
    pub(crate) fn stretched(self, factor: u32) -> Stretched {
        let weigh = match self {
            Kernel::Box | Kernel::Min | Kernel::Max | Kernel::Majority => Weigh::Repeated(&[1.0, 1.0]),
            Kernel::Nearest => Weigh::Repeated(&[1.0, 0.0]),
            Kernel::Gauss4 => Weigh::Repeated(&[1.0, 3.0, 3.0, 1.0]),
            Kernel::Sharpen4 => Weigh::Repeated(&[-1.0, 5.0, 5.0, -1.0]),
            Kernel::Gauss3 => Weigh::Drawn(&[1.0, 2.0, 1.0]),
            Kernel::Sharpen5 => Weigh::Drawn(&[-1.0, 2.0, 6.0, 2.0, -1.0]),
            Kernel::Kaiser => Weigh::Sinc(|t| {
                bessel_i0(KAISER_ALPHA * (1.0 - t * t).max(0.0).sqrt()) / bessel_i0(KAISER_ALPHA)
            }),
            Kernel::Lanczos => Weigh::Sinc(sinc),
        };
        Stretched::new(weigh, factor)
    }

    /// The weights for a factor, as [`Kernel::stretched`], all at once.
    pub(crate) fn weights(self, factor: u32) -> Weights {
        let stretched = self.stretched(factor);
        let sum = stretched.sum();
        let each = (0..stretched.count).map(|tap| stretched.weight(tap) / sum).collect();
        Weights { first: stretched.first, each }
    }
}

/// A kernel stretched to a factor: its weights one at a time, as large factors want them. Texel
/// `factor * i + first` is the first of `count` that texel `i` of the coarser level is made of.
#[derive(Clone, Copy)]
pub(crate) struct Stretched {
    pub(crate) first: i64,
    pub(crate) count: i64,
    factor: i64,
    weigh: Weigh,
}

/// How weights depend on the factor.
#[derive(Clone, Copy)]
enum Weigh {
    /// An even number of weights, each given to `factor / 2` texels.
    Repeated(&'static [f64]),
    /// An odd number of weights, `factor / 2` texels apart, with straight lines between them and down to 0 on
    /// both sides.
    Drawn(&'static [f64]),
    /// A sinc under this window of -1 to 1.
    Sinc(fn(f64) -> f64),
}

impl Stretched {
    fn new(weigh: Weigh, factor: u32) -> Stretched {
        let factor = i64::from(factor);
        let half = factor / 2;
        let (first, count) = match weigh {
            Weigh::Repeated(weights) => {
                let weights = weights.len() as i64;
                ((1 - weights / 2) * half, weights * half)
            }
            Weigh::Drawn(weights) => {
                let reach = (weights.len() as i64 / 2 + 1) * half - 1;
                (-reach, 2 * reach + 1)
            }
            Weigh::Sinc(_) => {
                let count = 2 * (SINC_RADIUS * factor as f64) as i64;
                ((factor - count) / 2, count)
            }
        };
        Stretched { first, count, factor, weigh }
    }

    /// One of the weights, 0 to `count`, not yet divided by their [`Stretched::sum`].
    pub(crate) fn weight(&self, tap: i64) -> f64 {
        let half = self.factor / 2;
        let at = |weights: &[f64], i: i64| usize::try_from(i).ok().and_then(|i| weights.get(i).copied());
        match self.weigh {
            Weigh::Repeated(weights) => at(weights, tap / half).unwrap_or(0.0),
            Weigh::Drawn(weights) => {
                let (step, part) = ((tap + 1) / half - 1, ((tap + 1) % half) as f64 / half as f64);
                let at = |step| at(weights, step).unwrap_or(0.0);
                at(step) * (1.0 - part) + at(step + 1) * part
            }
            Weigh::Sinc(window) => {
                let x = (tap as f64 + 0.5) / self.factor as f64 - SINC_RADIUS;
                sinc(x) * window(x / SINC_RADIUS)
            }
        }
    }

    /// Of all weights. Looks at each of them.
    pub(crate) fn sum(&self) -> f64 {
        (0..self.count).map(|tap| self.weight(tap)).sum()
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) }
}

/// The modified Bessel function of the first kind and order 0, by its power series.
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for n in 1..64 {
        term *= (x / (2.0 * f64::from(n))).powi(2);
        if sum + term == sum {
            break;
        }
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
            let weights = kernel.weights(factor);
            let sum: f64 = expected.iter().sum();
            let expected: Vec<f64> = expected.iter().map(|weight| weight / sum).collect();
            assert_eq!((weights.first, weights.each), (first, expected), "{kernel:?} {factor}");
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
                let Weights { first, each: weights } = kernel.weights(factor);
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
