//! How the level of a texture is chosen before its pool's mip bias: a clamp of levels and a bias of its own.
//!
//! Where a pixel says which page it wants, the arithmetic is that of the shaders; where a group does, that of
//! `groups`.

use crate::texture::geometry::Geometry;

/// The level of a texture at mip bias 0 is `min(max(lambda + bias, finest), coarsest)`, `lambda` being how
/// many levels coarser than level 0 a pixel is. The pool's mip bias comes on top, so memory that is too small
/// may go beyond `coarsest`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelRule {
    /// Levels added: above 0 coarser and less to load, below 0 sharper and more. From -32 to 32; no number
    /// counts as 0.
    pub bias: f32,
    /// The finest level that is shown or asked for.
    pub finest: u8,
    /// The coarsest; beyond that of the texture, and below `finest`, the nearest that can be.
    pub coarsest: u8,
}

impl Default for LevelRule {
    /// Every level, without a bias.
    fn default() -> LevelRule {
        LevelRule { bias: 0.0, finest: 0, coarsest: u8::MAX }
    }
}

impl LevelRule {
    /// The largest bias, in levels.
    pub const MAX_BIAS: f32 = 32.0;

    /// The rule as it acts on a texture of this shape.
    pub fn within(self, geometry: &Geometry) -> LevelRule {
        let finest = self.finest.min(geometry.coarsest());
        let coarsest = self.coarsest.clamp(finest, geometry.coarsest());
        let bias = if self.bias.is_nan() { 0.0 } else { self.bias.clamp(-Self::MAX_BIAS, Self::MAX_BIAS) };
        LevelRule { bias, finest, coarsest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;

    #[test]
    fn a_rule_keeps_to_the_levels_that_there_are() {
        let geometry = Geometry::new(GeometrySpec::image(1000, 1000)).unwrap(); // levels 0 to 10
        let within = |bias, finest, coarsest| LevelRule { bias, finest, coarsest }.within(&geometry);
        assert_eq!(LevelRule::default().within(&geometry), within(0.0, 0, 10));
        assert_eq!(within(f32::NAN, 20, 3), LevelRule { bias: 0.0, finest: 10, coarsest: 10 });
        assert_eq!(within(f32::INFINITY, 4, 3), LevelRule { bias: 32.0, finest: 4, coarsest: 4 });
    }
}
