//! How a value becomes a shade from black to white: its range, the exposure, and the curve and the exponent
//! within it.
//!
//! The shaders' part of it is `Tone` in surface.wgsl. Two of the curves are for pictures of light that is far
//! brighter than a screen: that of E. Reinhard, M. Stark, P. Shirley and J. Ferwerda, "Photographic Tone
//! Reproduction for Digital Images" (2002, its equation 4), and K. Narkowicz's fit of the ACES reference
//! curve, "ACES Filmic Tone Mapping Curve" (2015).

use std::fmt::Write as _;

use super::srgb_from_linear;

/// A curve from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Curve {
    /// A straight line.
    #[default]
    Linear,
    /// A logarithm, `ln(1000 x + 1) / ln 1001`, by which a hundredth of the range is a third of the shades:
    /// for values of which few are far larger than most, as in pictures of the sky.
    Log,
    /// Values are amounts of light, as in pictures with floats, and are encoded for a screen as sRGB has it.
    /// What is brighter than white is white.
    Light,
    /// Light as well. Bright light grows ever slower towards white, which eight times the white of the range
    /// is: a Reinhard curve, which turns that white into light of 0.51.
    Reinhard,
    /// Light as well, with a darker foot and more contrast, as films have it: Narkowicz's fit of the ACES
    /// curve, which turns the white of the range into light of 0.80, and eight times as much into white.
    Aces,
}

/// Light of `x` as light on a screen: `x (a x + b) / (x (c x + d) + e)`, at most 1.
type RollOff = [f32; 5];

/// White is eight times the white of the range.
const REINHARD: RollOff = [1.0 / 64.0, 1.0, 0.0, 1.0, 1.0];
const ACES: RollOff = [2.51, 0.03, 2.43, 0.59, 0.14];
/// Beyond so much light both are white, and squares of it are numbers.
const MOST_LIGHT: f32 = 1e6;

impl Curve {
    /// Every curve.
    pub const ALL: [Curve; 5] = [Curve::Linear, Curve::Log, Curve::Light, Curve::Reinhard, Curve::Aces];

    /// The name in words of a command line.
    pub fn name(self) -> &'static str {
        match self {
            Curve::Linear => "linear",
            Curve::Log => "log",
            Curve::Light => "light",
            Curve::Reinhard => "reinhard",
            Curve::Aces => "aces",
        }
    }

    /// The curve of a name.
    pub fn named(name: &str) -> Option<Curve> {
        Curve::ALL.into_iter().find(|curve| curve.name() == name)
    }

    /// Returns true if the curve takes values for light.
    pub fn is_of_light(self) -> bool {
        matches!(self, Curve::Light | Curve::Reinhard | Curve::Aces)
    }

    fn roll_off(self) -> Option<RollOff> {
        match self {
            Curve::Linear | Curve::Log | Curve::Light => None,
            Curve::Reinhard => Some(REINHARD),
            Curve::Aces => Some(ACES),
        }
    }

    /// The factor of `x` in a logarithm; 0 where there is none, which shaders do not ask for.
    fn factor(self) -> f32 {
        match self {
            Curve::Log => 1000.0,
            _ => 0.0,
        }
    }

    /// The numbers that surface.wgsl has of curves.
    pub(super) fn wgsl() -> String {
        let mut text = format!("const SCENE_MOST_LIGHT: f32 = {MOST_LIGHT:?};\n");
        for (name, numbers) in [("REINHARD", REINHARD), ("ACES", ACES)] {
            let [a, b, c, d, e] = numbers;
            let _ = writeln!(text, "const SCENE_{name}_ABOVE: vec2<f32> = vec2<f32>({a:?}, {b:?});");
            let _ = writeln!(text, "const SCENE_{name}_BELOW: vec3<f32> = vec3<f32>({c:?}, {d:?}, {e:?});");
        }
        text
    }
}

/// How values become shades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// The values that are black and white, in what shaders sample.
    pub range: [f32; 2],
    /// How much lighter all is than the range says, in stops: one doubles what lies above black.
    pub exposure: f32,
    /// The curve of what lies in the range, taken as 0 to 1.
    pub curve: Curve,
    /// The exponent of what the curve gives: below 1 what is dark becomes lighter.
    pub gamma: f32,
}

impl Default for Tone {
    fn default() -> Tone {
        Tone { range: [0.0, 1.0], exposure: 0.0, curve: Curve::Linear, gamma: 1.0 }
    }
}

impl Tone {
    /// The shade of a value: 0 for black, 1 for white, less or more beyond them. Of a layer whose values are
    /// light (`is_light`) the shade is light as well, else a display value.
    pub fn shade(&self, value: f32, is_light: bool) -> f32 {
        let [black, factor, curve, gamma] = self.told();
        let mut shade = (value - black) * factor;
        if self.curve == Curve::Log {
            shade = (shade.max(0.0) * curve + 1.0).log2() / (curve + 1.0).log2();
        }
        if let Some([a, b, c, d, e]) = self.curve.roll_off() {
            let light = shade.clamp(0.0, MOST_LIGHT);
            shade = ((light * (a * light + b)) / (light * (c * light + d) + e)).min(1.0);
        }
        if self.curve.is_of_light() && !is_light {
            shade = srgb_from_linear(shade.max(0.0));
        }
        if gamma == 1.0 { shade } else { shade.max(0.0).powf(gamma) }
    }

    /// What shaders are told, as `Tone` has it.
    pub(crate) fn told(&self) -> [f32; 4] {
        let [black, white] = self.range;
        [black, self.exposure.exp2() / (white - black), self.curve.factor(), self.gamma]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_go_from_black_to_white() {
        for curve in Curve::ALL {
            assert_eq!(Curve::named(curve.name()), Some(curve));
            let tone = Tone { range: [-2.0, 6.0], curve, gamma: 0.5, ..Tone::default() };
            let shades: Vec<f32> = (0..=32).map(|n| tone.shade(-2.0 + n as f32 / 4.0, false)).collect();
            assert!(shades.is_sorted_by(|a, b| a < b), "{curve:?}: {shades:?}");
            let white = match curve {
                Curve::Reinhard | Curve::Aces => shades[32] > 0.8 && shades[32] < 0.96,
                _ => (shades[32] - 1.0).abs() < 1e-6,
            };
            assert!(shades[0] == 0.0 && white, "{curve:?}: {shades:?}");
        }
        let log = Tone { curve: Curve::Log, ..Tone::default() };
        assert!((log.shade(0.01, false) - 0.347).abs() < 0.001, "{}", log.shade(0.01, false));
        // Below black nothing is a number that is none.
        assert_eq!(
            Curve::ALL.map(|curve| Tone { curve, ..Tone::default() }.shade(-1.0, false).is_nan()),
            [false; 5]
        );
    }

    /// By the formulas of the papers.
    #[test]
    fn bright_light_is_rolled_off_as_published() {
        let shade = |curve, exposure, light| Tone { curve, exposure, ..Tone::default() }.shade(light, true);
        for light in [0.0, 0.01, 0.18, 0.5, 1.0, 3.0, 7.9] {
            let reinhard = light * (1.0 + light / (8.0 * 8.0)) / (1.0 + light);
            assert!((shade(Curve::Reinhard, 0.0, light) - reinhard).abs() < 1e-6, "{light}");
            let aces: f32 = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14);
            assert!((shade(Curve::Aces, 0.0, light) - aces.min(1.0)).abs() < 1e-6, "{light}");
        }
        for curve in [Curve::Reinhard, Curve::Aces] {
            assert_eq!(
                [8.0, 1e20, f32::INFINITY].map(|light| shade(curve, 0.0, light)),
                [1.0; 3],
                "{curve:?}"
            );
            // Stops double and halve light.
            assert_eq!(shade(curve, 2.0, 0.1), shade(curve, 0.0, 0.4));
            assert_eq!(shade(curve, -1.0, 0.5), shade(curve, 0.0, 0.25));
        }
        // On a screen: of values that are light already the target encodes them.
        let light = Tone { curve: Curve::Light, ..Tone::default() };
        assert!((light.shade(0.214, false) - 0.5).abs() < 1e-3 && light.shade(0.214, true) == 0.214);
    }
}
