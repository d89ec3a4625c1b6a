//! What is seen where a picture has nothing to show: around it, and through it.

use glam::Vec4;

use super::{BACKGROUND, srgb_from_linear};

/// What is seen through what is transparent or without data, and around the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ground {
    /// [`BACKGROUND`], which is nearly black.
    #[default]
    Dark,
    /// A light grey.
    Light,
    /// Squares of white and light grey, 12 pixels a side, as painting programs have them; around the picture
    /// it is dark.
    Chequers,
}

/// The light of the light ground, and of chequers: of the darker squares, and how much lighter the others
/// are.
const LIGHT: Vec4 = Vec4::new(0.787, 0.787, 0.807, 1.0);
const CHEQUERS: Vec4 = Vec4::new(0.604, 0.604, 0.604, 1.0);
const LIGHTER: f32 = 0.396;

impl Ground {
    /// Every ground.
    pub const ALL: [Ground; 3] = [Ground::Dark, Ground::Light, Ground::Chequers];

    /// A word for it.
    pub fn name(self) -> &'static str {
        match self {
            Ground::Dark => "dark",
            Ground::Light => "light",
            Ground::Chequers => "chequers",
        }
    }

    /// The light that is seen around the picture: red, green, blue and an alpha of 1.
    pub fn beside(self) -> Vec4 {
        match self {
            Ground::Dark | Ground::Chequers => BACKGROUND,
            Ground::Light => LIGHT,
        }
    }

    /// What shaders are told, as light or else as display values: what is around the picture; what is seen
    /// through it, and how much lighter every other square of that is.
    pub(crate) fn told(self, is_light: bool) -> [Vec4; 2] {
        let value = |light: f32| if is_light { light } else { srgb_from_linear(light) };
        let told = |color: Vec4| color.truncate().map(value).extend(color.w);
        let beside = told(self.beside());
        match self {
            Ground::Dark | Ground::Light => [beside, beside.truncate().extend(0.0)],
            Ground::Chequers => {
                let darker = told(CHEQUERS);
                [beside, darker.truncate().extend(value(CHEQUERS.x + LIGHTER) - darker.x)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_told_is_light_or_display_values() {
        for is_light in [true, false] {
            assert_eq!(Ground::Dark.told(is_light)[0], super::super::background(is_light));
            let [_, ground] = Ground::Dark.told(is_light);
            assert_eq!(ground, super::super::background(is_light).truncate().extend(0.0));
            let [_, chequers] = Ground::Chequers.told(is_light);
            assert!(
                (chequers.x + chequers.w - 1.0).abs() < 1e-3,
                "the lighter squares are white: {chequers}"
            );
        }
        assert!(Ground::Light.told(true)[0].x > 0.5);
    }
}
