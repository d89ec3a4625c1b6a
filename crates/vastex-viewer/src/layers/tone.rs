//! How a value becomes a shade from black to white: its range, and the curve and the exponent within it.
//!
//! The shaders' part of it is `Tone` in surface.wgsl.

/// A curve from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Curve {
    /// A straight line.
    #[default]
    Linear,
    /// A logarithm, `ln(1000 x + 1) / ln 1001`, by which a hundredth of the range is a third of the shades:
    /// for values of which few are far larger than most, as in pictures of the sky.
    Log,
}

impl Curve {
    /// Every curve.
    pub const ALL: [Curve; 2] = [Curve::Linear, Curve::Log];

    /// The name in words of a command line.
    pub fn name(self) -> &'static str {
        match self {
            Curve::Linear => "linear",
            Curve::Log => "log",
        }
    }

    /// The factor of `x` in it; 0 for a straight line, which shaders do not ask for.
    fn factor(self) -> f32 {
        match self {
            Curve::Linear => 0.0,
            Curve::Log => 1000.0,
        }
    }
}

/// How values become shades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// The values that are black and white, in what shaders sample.
    pub range: [f32; 2],
    /// The curve of what lies in the range, taken as 0 to 1.
    pub curve: Curve,
    /// The exponent of what the curve gives: below 1 what is dark becomes lighter.
    pub gamma: f32,
}

impl Default for Tone {
    fn default() -> Tone {
        Tone { range: [0.0, 1.0], curve: Curve::Linear, gamma: 1.0 }
    }
}

impl Tone {
    /// The shade of a value: 0 for black, 1 for white, less or more beyond them.
    pub fn shade(&self, value: f32) -> f32 {
        let [black, factor, curve, gamma] = self.told();
        let mut shade = (value - black) * factor;
        if self.curve != Curve::Linear {
            shade = (shade.max(0.0) * curve + 1.0).log2() / (curve + 1.0).log2();
        }
        if gamma == 1.0 { shade } else { shade.max(0.0).powf(gamma) }
    }

    /// What shaders are told, as `Tone` has it.
    pub(crate) fn told(&self) -> [f32; 4] {
        let [black, white] = self.range;
        [black, 1.0 / (white - black), self.curve.factor(), self.gamma]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_go_from_black_to_white() {
        for curve in Curve::ALL {
            let tone = Tone { range: [-2.0, 6.0], curve, gamma: 0.5 };
            let shades: Vec<f32> = (0..=32).map(|n| tone.shade(-2.0 + n as f32 / 4.0)).collect();
            assert!(shades.is_sorted_by(|a, b| a < b), "{curve:?}: {shades:?}");
            assert_eq!((shades[0], shades[32]), (0.0, 1.0), "{curve:?}");
        }
        let log = Tone { curve: Curve::Log, ..Tone::default() };
        assert!((log.shade(0.01) - 0.347).abs() < 0.001, "{}", log.shade(0.01));
        // Below black nothing is a number that is none.
        assert_eq!(log.shade(-1.0), 0.0);
    }
}
