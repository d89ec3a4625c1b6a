//! Twin of level.wgsl: from gradients to a level.

use vastex_core::shared::STEPS_PER_LEVEL;

use super::Texture;

const FINEST: f32 = -1024.0;
const COARSEST: f32 = 1024.0;

/// The lambda that stands for gradients that say nothing of a level; nothing where they are ordinary.
pub(super) fn degenerate_lambda(dx: [f32; 2], dy: [f32; 2]) -> Option<f32> {
    let all = [dx[0], dx[1], dy[0], dy[1]];
    if all.iter().any(|g| !g.is_finite()) {
        return Some(COARSEST);
    }
    all.iter().all(|&g| g == 0.0).then_some(FINEST)
}

/// How many levels coarser than level 0 a pixel is; `dx` and `dy` are texels of level 0 along one pixel.
pub(super) fn lambda(dx: [f32; 2], dy: [f32; 2]) -> f32 {
    let square = |g: [f32; 2]| g[0] * g[0] + g[1] * g[1];
    degenerate_lambda(dx, dy).unwrap_or_else(|| 0.5 * square(dx).max(square(dy)).clamp(1e-30, 1e30).log2())
}

impl Texture<'_> {
    /// The level at mip bias 0.
    pub fn unbiased_level(&self, lambda: f32) -> f32 {
        let rule = &self.rule;
        (lambda + rule.bias).max(f32::from(rule.finest)).min(f32::from(rule.coarsest))
    }

    /// The level that is sampled.
    pub fn level(&self, lambda: f32) -> f32 {
        let pool_bias = f32::from(self.pool_bias) / STEPS_PER_LEVEL as f32;
        (self.unbiased_level(lambda) + pool_bias).min(f32::from(self.geometry.coarsest()))
    }

    /// The lambda of gradients of uv along one pixel.
    pub fn lambda(&self, ddx: [f32; 2], ddy: [f32; 2]) -> f32 {
        lambda(self.texels(ddx), self.texels(ddy))
    }

    pub(super) fn texels(&self, uv: [f32; 2]) -> [f32; 2] {
        let size = self.geometry.size();
        [0, 1].map(|a| uv[a] * size[a] as f32)
    }
}
