//! Colour maps: how one value from 0 to 1 becomes a colour, as a display value.
//!
//! Each is a polynomial of the sixth degree, the same on the CPU and in the shaders, which are generated from
//! the numbers here.

use std::fmt::Write;

/// A colour map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Palette {
    /// From black to white.
    #[default]
    Grey,
    /// From dark violet by green to yellow, as evenly as the eye sees.
    Viridis,
    /// From black by red to pale yellow, as evenly as the eye sees.
    Inferno,
}

/// Red, green and blue of each power, the lowest first.
type Polynomial = [[f32; 3]; 7];

const VIRIDIS: Polynomial = [
    [0.277_727_3, 0.005_407_344_5, 0.334_099_8],
    [0.105_093_04, 1.404_613_5, 1.384_590_2],
    [-0.330_861_84, 0.214_847_55, 0.095_095_165],
    [-4.634_230_6, -5.799_101, -19.332_441],
    [6.228_27, 14.179_934, 56.690_55],
    [4.776_385, -13.745_145, -65.353_035],
    [-5.435_456, 4.645_852_6, 26.312_435],
];
const INFERNO: Polynomial = [
    [0.000_218_940_37, 0.001_651_004_7, -0.019_480_899],
    [0.106_513_42, 0.563_956_44, 3.932_712_3],
    [11.602_493, -3.972_854, -15.942_394],
    [-41.703_995, 17.436_398, 44.354_145],
    [77.162_94, -33.402_36, -81.807_31],
    [-71.319_43, 32.626_064, 73.209_52],
    [25.131_126, -12.242_669, -23.070_325],
];

impl Palette {
    /// Every map.
    pub const ALL: [Palette; 3] = [Palette::Grey, Palette::Viridis, Palette::Inferno];

    /// The name in words of a command line.
    pub fn name(self) -> &'static str {
        match self {
            Palette::Grey => "grey",
            Palette::Viridis => "viridis",
            Palette::Inferno => "inferno",
        }
    }

    fn polynomial(self) -> Option<&'static Polynomial> {
        match self {
            Palette::Grey => None,
            Palette::Viridis => Some(&VIRIDIS),
            Palette::Inferno => Some(&INFERNO),
        }
    }

    /// The colour of a value, as display values from 0 to 1.
    pub fn color(self, value: f32) -> [f32; 3] {
        let value = value.clamp(0.0, 1.0);
        let Some(powers) = self.polynomial() else { return [value; 3] };
        std::array::from_fn(|channel| {
            powers.iter().rev().fold(0.0, |sum, power| sum * value + power[channel]).clamp(0.0, 1.0)
        })
    }

    /// The function `palette_color(map, value)` of shaders, where `map` is the number that a palette is as
    /// `u32`.
    pub(super) fn wgsl() -> String {
        let mut text =
            "fn palette_color(map: u32, value: f32) -> vec3<f32> {\n    let v = clamp(value, 0.0, 1.0);\n"
                .to_owned();
        for palette in Palette::ALL {
            let Some(powers) = palette.polynomial() else { continue };
            let mut sum = "vec3<f32>(0.0)".to_owned();
            for [red, green, blue] in powers.iter().rev() {
                sum = format!("(({sum} * v) + vec3<f32>({red:?}, {green:?}, {blue:?}))");
            }
            let number = palette as u32;
            let _ = write!(
                text,
                "    if (!(value < -1e30)) & (map == {number}u) {{\n        return clamp({sum}, vec3<f32>(0.0), vec3<f32>(1.0));\n    }}\n"
            );
        }
        text + "    return vec3<f32>(v);\n}\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_begin_dark_and_end_light() {
        let brightness = |[r, g, b]: [f32; 3]| 0.21 * r + 0.72 * g + 0.07 * b;
        for palette in Palette::ALL {
            let shades: Vec<f32> = (0..=32).map(|n| brightness(palette.color(n as f32 / 32.0))).collect();
            assert!(shades.is_sorted_by(|a, b| *b > a - 0.005), "{palette:?}: {shades:?}");
            assert!(shades[0] < 0.1 && shades[32] > 0.8, "{palette:?}: {shades:?}");
        }
        assert_eq!(Palette::Grey.color(0.5), [0.5; 3]);
        let [r, g, b] = Palette::Viridis.color(0.5); // 0x21918c
        assert!(
            (r - 0.129).abs() < 0.02 && (g - 0.569).abs() < 0.02 && (b - 0.549).abs() < 0.02,
            "{r} {g} {b}"
        );
    }
}
