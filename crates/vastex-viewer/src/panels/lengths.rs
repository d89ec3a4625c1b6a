//! How long a texel is in the world, and lengths in words.

use glam::DVec2;

/// Metres in a unit, by the names that files have for it.
const METRES: [(&str, f64); 13] = [
    ("pm", 1e-12),
    ("Å", 1e-10),
    ("nm", 1e-9),
    ("µm", 1e-6),
    ("um", 1e-6),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("dm", 1e-1),
    ("m", 1.0),
    ("metre", 1.0),
    ("meter", 1.0),
    ("km", 1e3),
    ("inch", 0.0254),
];
/// Units that lengths are told in, the longest first.
const TOLD: [(&str, f64); 5] = [("km", 1e3), ("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9)];

/// Width and height of a texel of level 0 in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct TexelSize {
    /// In metres, or in the unit.
    size: DVec2,
    /// Where that is no unit of length: degrees, or something else.
    unit: Option<String>,
}

impl TexelSize {
    /// Of a size in a unit as files name it: one of length (`µm`, `metre`, ...), `degree`, or any other that has a name. Nothing where the
    /// size is not positive.
    pub fn new(size: [f64; 2], unit: &str) -> Option<TexelSize> {
        let is_size = |side: f64| side.is_finite() && side > 0.0;
        if !size.into_iter().all(is_size) {
            return None;
        }
        let metres = METRES.iter().find(|(name, _)| *name == unit).map(|(_, metres)| *metres);
        let unit =
            metres.is_none().then(|| if unit == "degree" { "°".to_owned() } else { format!(" {unit}") });
        Some(TexelSize { size: DVec2::from(size) * metres.unwrap_or(1.0), unit })
    }

    /// How long a step of so many texels is, in [`TexelSize::round`]'s numbers.
    pub(super) fn length(&self, texels: DVec2) -> f64 {
        (texels * self.size).length()
    }

    /// The longest of 1, 2 and 5 times a power of ten that is no longer than so much, and how it is told; nothing of what is no length.
    pub(super) fn round(&self, most: f64) -> Option<(f64, String)> {
        let unit = match &self.unit {
            Some(unit) => (unit.clone(), 1.0),
            None => {
                let fitting =
                    TOLD.iter().find(|(_, metres)| most >= *metres).unwrap_or(&TOLD[TOLD.len() - 1]);
                (format!(" {}", fitting.0), fitting.1)
            }
        };
        let (length, decimals) = round_length(most / unit.1)?;
        Some((length * unit.1, format!("{length:.decimals$}{}", unit.0)))
    }
}

/// The longest of 1, 2 and 5 times a power of ten that is no longer than so much, and how many digits it has after its point.
pub(super) fn round_length(most: f64) -> Option<(f64, usize)> {
    if !(1e-15..1e15).contains(&most) {
        return None;
    }
    let exponent = most.log10().floor() as i32;
    let round = |times: f64, exponent: i32| (times * 10f64.powi(exponent), (-exponent).max(0) as usize);
    // What a logarithm rounds may name the power above.
    let lengths = [(5.0, exponent), (2.0, exponent), (1.0, exponent), (5.0, exponent - 1)];
    lengths.map(|(times, exponent)| round(times, exponent)).into_iter().find(|(length, _)| *length <= most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_round_and_told_in_a_fitting_unit() {
        let slide = TexelSize::new([0.499; 2], "µm").unwrap();
        let told = |size: &TexelSize, texels: f64| {
            let (length, text) = size.round(size.length(DVec2::new(texels, 0.0))).unwrap();
            (length, text)
        };
        let (length, text) = told(&slide, 100.0);
        assert!((length / 2e-5 - 1.0).abs() < 1e-12 && text == "20 µm", "{length} {text}");
        assert_eq!(told(&slide, 1.0).1, "200 nm");
        assert_eq!(told(&slide, 1e5).1, "20 mm");
        let map = TexelSize::new([10.0, 20.0], "metre").unwrap();
        assert_eq!(told(&map, 160.0).1, "1 km");
        assert_eq!(map.length(DVec2::new(0.0, 3.0)), 60.0);
        let globe = TexelSize::new([1.0 / 30.0; 2], "degree").unwrap();
        assert_eq!(told(&globe, 160.0).1, "5°");
        assert_eq!(told(&globe, 2.0).1, "0.05°");
        assert_eq!(told(&TexelSize::new([2.0; 2], "furlong").unwrap(), 100.0).1, "200 furlong");
        for (size, unit) in [([0.0, 1.0], "µm"), ([1.0, f64::NAN], "metre"), ([-1.0; 2], "degree")] {
            assert_eq!(TexelSize::new(size, unit), None);
        }
    }

    #[test]
    fn a_round_length_is_no_longer_than_asked() {
        for (most, length) in [
            (0.9, 0.5),
            (1.0, 1.0),
            (4.9, 2.0),
            (5.0, 5.0),
            (1999.0, 1000.0),
            (1000.0, 1000.0),
            (0.001, 0.001),
        ] {
            let (found, _) = round_length(most).unwrap();
            assert!((found / length - 1.0).abs() < 1e-12, "{most}: {found}");
        }
        for most in [f64::INFINITY, f64::NAN, 0.0, -1.0] {
            assert_eq!(round_length(most), None);
        }
    }
}
