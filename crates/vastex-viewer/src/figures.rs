//! Figures for people: round lengths, round tops of scales, and bytes.

/// The least of 1, 2 and 5 times a power of ten that is at least `value`, give or take a millionth of it;
/// `value` itself where it is not above 0, or is beyond 1e15 or below 1e-15.
///
/// ```
/// use vastex_viewer::figures::round_up;
/// assert_eq!([0.7, 2.0, 2.1, 60.0].map(round_up), [1.0, 2.0, 5.0, 100.0]);
/// ```
pub fn round_up(value: f64) -> f64 {
    let least = value * (1.0 - 1e-6);
    let round = rounds(value).and_then(|all| all.into_iter().find(|(round, _)| *round >= least));
    round.map_or(value, |(round, _)| round)
}

/// The largest of 1, 2 and 5 times a power of ten that is no more than `value`, and how many digits it has
/// after its point; `None` where `value` is not above 0, or is beyond 1e15 or below 1e-15.
///
/// ```
/// use vastex_viewer::figures::round_down;
/// assert_eq!(round_down(0.03), Some((0.02, 2)));
/// assert_eq!(round_down(1999.0), Some((1000.0, 0)));
/// ```
pub fn round_down(value: f64) -> Option<(f64, usize)> {
    rounds(value)?.into_iter().rev().find(|(round, _)| *round <= value)
}

/// The round numbers about a value, the least first, with their digits after the point.
fn rounds(value: f64) -> Option<[(f64, usize); 6]> {
    if !(1e-15..1e15).contains(&value) {
        return None;
    }
    let exponent = value.log10().floor() as i32;
    // What a logarithm rounds may name the power above, or the one below.
    let all = [(5.0, -1), (1.0, 0), (2.0, 0), (5.0, 0), (1.0, 1), (2.0, 1)];
    Some(all.map(|(times, more)| {
        let exponent = exponent + more;
        (times * 10f64.powi(exponent), (-exponent).max(0) as usize)
    }))
}

/// A number of bytes in the unit that suits it, to two or more digits.
///
/// ```
/// use vastex_viewer::figures::bytes;
/// assert_eq!([0.0, 1536.0, 20480.0, 12.6e6].map(bytes), ["0 B", "1.5 KiB", "20 KiB", "12 MiB"]);
/// ```
pub fn bytes(count: f64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let power = (count.max(1.0).log2() / 10.0).floor().clamp(0.0, 4.0);
    let (scaled, unit) = (count / 1024f64.powf(power), UNITS[power as usize]);
    let digits = usize::from(scaled < 10.0);
    let text = format!("{scaled:.digits$}");
    format!("{} {unit}", text.strip_suffix(".0").unwrap_or(&text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_numbers_are_found_on_either_side() {
        for (value, down, up) in [
            (0.9, 0.5, 1.0),
            (1.0, 1.0, 1.0),
            (4.9, 2.0, 5.0),
            (5.0, 5.0, 5.0),
            (7.0, 5.0, 10.0),
            (1999.0, 1000.0, 2000.0),
            (1000.0, 1000.0, 1000.0),
            (0.001, 0.001, 0.001),
        ] {
            let (found, _) = round_down(value).unwrap();
            assert!((found / down - 1.0).abs() < 1e-12, "{value}: {found}");
            assert!((round_up(value) / up - 1.0).abs() < 1e-12, "{value}: {}", round_up(value));
        }
        // As a number of 32 bits it is a little more.
        assert_eq!(round_up(f64::from(0.2f32)), 0.2);
        for value in [f64::INFINITY, 0.0, -1.0] {
            assert_eq!((round_down(value), round_up(value)), (None, value));
        }
        assert!(round_down(f64::NAN).is_none() && round_up(f64::NAN).is_nan());
    }
}
