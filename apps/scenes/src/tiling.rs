//! How a texture lies on a surface: once, or again and again, from its corner or from elsewhere.
//!
//! What is beyond its edges is the address mode's business; how a shader says that its uv jumps, surface.wgsl's.

use glam::{BVec2, Vec2};

/// How a texture lies on a surface without heights. Estimates without feedback know of the default alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tiling {
    /// How many times the texture lies along u and v of the surface.
    pub repeats: Vec2,
    /// The uv of the texture at the surface's first corner; half a turn brings a globe's date line to its middle.
    pub first: Vec2,
    /// Along which axes the shader folds uv into 0 to 1, as it does that computes uv from an angle: it jumps there between
    /// neighbouring pixels, and is sampled as uv that jumps. For axes that wrap.
    pub folded: BVec2,
}

impl Default for Tiling {
    /// Once, from corner to corner.
    fn default() -> Tiling {
        Tiling { repeats: Vec2::ONE, first: Vec2::ZERO, folded: BVec2::FALSE }
    }
}

impl Tiling {
    /// The constants that surface.wgsl needs beside it.
    pub fn wgsl(&self) -> String {
        let Tiling { repeats, first, folded } = self;
        format!(
            "const SCENE_REPEATS: vec2<f32> = vec2<f32>({:?}, {:?});\nconst SCENE_FIRST: vec2<f32> = vec2<f32>({:?}, {:?});\n\
             const SCENE_FOLDED: vec2<bool> = vec2<bool>({}, {});\n",
            repeats.x, repeats.y, first.x, first.y, folded.x, folded.y
        )
    }
}
