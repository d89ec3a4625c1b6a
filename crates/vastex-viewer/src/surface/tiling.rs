//! How a texture lies on a surface: once, or again and again, from its corner or from elsewhere.
//!
//! What is beyond its edges is the address mode's business; how a shader says that its uv jumps,
//! surface.wgsl's.

use glam::{BVec2, Vec2};

/// How a texture lies on a surface without heights. Estimates without feedback know of the default alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tiling {
    /// How many times the texture lies along u and v of the surface.
    pub repeats: Vec2,
    /// The uv of the texture at the surface's first corner; half a turn brings a globe's date line to its
    /// middle.
    pub first: Vec2,
    /// Along which axes the shader folds uv into 0 to 1, as it does that computes uv from an angle: it jumps
    /// there between neighbouring pixels, and is sampled as uv that jumps. For axes that wrap.
    pub folded: BVec2,
}

impl Default for Tiling {
    /// Once, from corner to corner.
    fn default() -> Tiling {
        Tiling { repeats: Vec2::ONE, first: Vec2::ZERO, folded: BVec2::FALSE }
    }
}

impl Tiling {
    /// What pipelines with surface.wgsl are made with.
    pub(crate) fn constants(&self) -> [(&'static str, f64); 6] {
        let Tiling { repeats, first, folded } = *self;
        [
            ("SCENE_REPEATS_U", repeats.x.into()),
            ("SCENE_REPEATS_V", repeats.y.into()),
            ("SCENE_FIRST_U", first.x.into()),
            ("SCENE_FIRST_V", first.y.into()),
            ("SCENE_FOLDS_U", f64::from(u8::from(folded.x))),
            ("SCENE_FOLDS_V", f64::from(u8::from(folded.y))),
        ]
    }
}
