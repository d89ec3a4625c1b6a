//! Numbers that are reduced: how each kind is added up, divided, compared and stored.

/// A kind of number of `N` bytes.
pub(super) trait Number<const N: usize>: Copy + Default + Send + Sync {
    /// What eight of them fit in when they are added up.
    type Sum: Copy + Default;

    fn of_bytes(bytes: [u8; N]) -> Self;
    fn to_bytes(self) -> [u8; N];
    /// The number's bytes as a number without a sign.
    fn bits(self) -> u64;
    fn widen(self) -> Self::Sum;
    fn add(left: Self::Sum, right: Self::Sum) -> Self::Sum;
    /// The mean of 2^`log` numbers with that sum; `None` where [`Number::careful_mean`] must tell.
    fn mean(sum: Self::Sum, log: u32) -> Option<Self>;
    /// The mean of numbers some of which may be none, or whose sum may be too large.
    fn careful_mean(values: &[Self]) -> Self;
    fn max_of(left: Self, right: Self) -> Self;
    fn min_of(left: Self, right: Self) -> Self;
}

macro_rules! whole_number {
    ($kind:ty, $unsigned:ty, $sum:ty, $bytes:literal) => {
        impl Number<$bytes> for $kind {
            type Sum = $sum;

            fn of_bytes(bytes: [u8; $bytes]) -> $kind {
                <$kind>::from_le_bytes(bytes)
            }

            fn to_bytes(self) -> [u8; $bytes] {
                self.to_le_bytes()
            }

            fn bits(self) -> u64 {
                u64::from(self as $unsigned)
            }

            fn widen(self) -> $sum {
                <$sum>::from(self)
            }

            fn add(left: $sum, right: $sum) -> $sum {
                left + right
            }

            // Shifting numbers with a sign rounds down.
            fn mean(sum: $sum, log: u32) -> Option<$kind> {
                Some(((sum + ((1 << log) >> 1)) >> log) as $kind)
            }

            fn careful_mean(values: &[$kind]) -> $kind {
                values.first().copied().unwrap_or_default()
            }

            fn max_of(left: $kind, right: $kind) -> $kind {
                left.max(right)
            }

            fn min_of(left: $kind, right: $kind) -> $kind {
                left.min(right)
            }
        }
    };
}

whole_number!(u8, u8, u16, 1);
whole_number!(i8, u8, i16, 1);
whole_number!(u16, u16, u32, 2);
whole_number!(i16, u16, i32, 2);
whole_number!(u32, u32, u64, 4);
whole_number!(i32, u32, i64, 4);
whole_number!(u64, u64, u128, 8);
whole_number!(i64, u64, i128, 8);

macro_rules! float {
    ($kind:ty, $bytes:literal) => {
        impl Number<$bytes> for $kind {
            type Sum = f64;

            fn of_bytes(bytes: [u8; $bytes]) -> $kind {
                <$kind>::from_le_bytes(bytes)
            }

            fn to_bytes(self) -> [u8; $bytes] {
                self.to_le_bytes()
            }

            fn bits(self) -> u64 {
                u64::from(self.to_bits())
            }

            fn widen(self) -> f64 {
                self.into()
            }

            fn add(left: f64, right: f64) -> f64 {
                left + right
            }

            fn mean(sum: f64, log: u32) -> Option<$kind> {
                sum.is_finite().then(|| (sum / f64::from(1 << log)) as $kind)
            }

            fn careful_mean(values: &[$kind]) -> $kind {
                mean_of(values.iter().map(|value| f64::from(*value)))
                    .map_or(<$kind>::NAN, |mean| mean as $kind)
            }

            fn max_of(left: $kind, right: $kind) -> $kind {
                if left.is_nan() || right > left { right } else { left }
            }

            fn min_of(left: $kind, right: $kind) -> $kind {
                if left.is_nan() || right < left { right } else { left }
            }
        }
    };
}

float!(f32, 4);
float!(f64, 8);

/// The mean of those that are numbers, if one is.
fn mean_of(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let known = values.filter(|value| !value.is_nan());
    let count = known.clone().count();
    if count == 0 {
        return None;
    }
    let sum: f64 = known.clone().sum();
    if sum.is_finite() || !known.clone().all(f64::is_finite) {
        return Some(sum / count as f64);
    }
    Some(known.map(|value| value / count as f64).sum())
}

/// A float of 16 bits, by its bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct F16(u16);

impl F16 {
    const NAN: F16 = F16(0x7e00);

    fn is_nan(self) -> bool {
        self.0 & 0x7fff > 0x7c00
    }

    fn to_f64(self) -> f64 {
        let (exponent, fraction) = (i32::from(self.0 >> 10 & 31), f64::from(self.0 & 0x3ff));
        let magnitude = match exponent {
            0 => fraction * 2_f64.powi(-24),
            31 if fraction == 0.0 => f64::INFINITY,
            31 => f64::NAN,
            _ => (1024.0 + fraction) * 2_f64.powi(exponent - 25),
        };
        if self.0 >> 15 == 1 { -magnitude } else { magnitude }
    }

    /// The nearest one; ties go to the even one.
    fn of_f64(number: f64) -> F16 {
        let bits = number.to_bits();
        let sign = ((bits >> 48) & 0x8000) as u16;
        let magnitude = number.abs();
        let rest = if number.is_nan() {
            0x7e00
        } else if magnitude >= 65_520.0 {
            0x7c00
        } else if magnitude < 2_f64.powi(-14) {
            // Steps of 2^-24; the largest rounds up to the least normal one.
            (magnitude * 2_f64.powi(24)).round_ties_even() as u16
        } else {
            let bits = bits & !(1 << 63);
            let rounded = bits + (1 << 41) - 1 + ((bits >> 42) & 1);
            ((rounded >> 42) - (1008 << 10)) as u16
        };
        F16(sign | rest)
    }
}

impl Number<2> for F16 {
    type Sum = f64;

    fn of_bytes(bytes: [u8; 2]) -> F16 {
        F16(u16::from_le_bytes(bytes))
    }

    fn to_bytes(self) -> [u8; 2] {
        self.0.to_le_bytes()
    }

    fn bits(self) -> u64 {
        self.0.into()
    }

    fn widen(self) -> f64 {
        self.to_f64()
    }

    fn add(left: f64, right: f64) -> f64 {
        left + right
    }

    fn mean(sum: f64, log: u32) -> Option<F16> {
        sum.is_finite().then(|| F16::of_f64(sum / f64::from(1 << log)))
    }

    fn careful_mean(values: &[F16]) -> F16 {
        mean_of(values.iter().map(|value| value.to_f64())).map_or(F16::NAN, F16::of_f64)
    }

    fn max_of(left: F16, right: F16) -> F16 {
        if left.is_nan() || right.to_f64() > left.to_f64() { right } else { left }
    }

    fn min_of(left: F16, right: F16) -> F16 {
        if left.is_nan() || right.to_f64() < left.to_f64() { right } else { left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_exact_both_ways() {
        for bits in 0..=u16::MAX {
            let half = F16(bits);
            if half.is_nan() {
                assert!(half.to_f64().is_nan() && F16::of_f64(half.to_f64()).is_nan());
            } else {
                assert_eq!(F16::of_f64(half.to_f64()), half);
            }
        }
        // Between two neighbours, the even one, and to the nearer one just beside the middle.
        for bits in [0_u16, 1, 0x3ff, 0x400, 0x3c00, 0x7bfe] {
            let (low, high) = (F16(bits).to_f64(), F16(bits + 1).to_f64());
            let middle = (low + high) / 2.0;
            assert_eq!(F16::of_f64(middle).0, bits + (bits & 1), "{bits}");
            assert_eq!(F16::of_f64(-middle.next_up()).0, 0x8000 | (bits + 1));
            assert_eq!(F16::of_f64(middle.next_down()).0, bits);
        }
        assert_eq!((F16::of_f64(65_519.9).0, F16::of_f64(65_520.0).0), (0x7bff, 0x7c00));
    }

    #[test]
    fn sums_beyond_the_largest_float_are_means_all_the_same() {
        assert_eq!(f64::careful_mean(&[f64::MAX; 8]), f64::MAX);
        assert_eq!(f64::careful_mean(&[f64::INFINITY, 1.0]), f64::INFINITY);
        assert!(f64::careful_mean(&[f64::INFINITY, f64::NEG_INFINITY]).is_nan());
        assert_eq!(f32::careful_mean(&[f32::NAN, 3.0, 5.0, f32::NAN]), 4.0);
        assert!(f32::careful_mean(&[f32::NAN; 4]).is_nan());
    }
}
