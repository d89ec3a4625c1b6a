//! Twin of lambda.wgsl, footprint.wgsl, footprint_round.wgsl and levels.wgsl: from gradients to what a pixel
//! covers, and to a level.

use vastex_core::shader_constants::STEPS_PER_LEVEL;

use super::Texture;

const FINEST: f32 = -1024.0;
const COARSEST: f32 = 1024.0;

/// What a pixel covers of level 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    /// Levels coarser than level 0.
    pub(super) lambda: f32,
    /// The footprint's longer axis, along which taps lie, in texels of level 0.
    pub(super) axis: [f32; 2],
}

/// The lambda that stands for gradients that say nothing of a level; `None` if they are ordinary.
pub(super) fn degenerate_lambda(dx: [f32; 2], dy: [f32; 2]) -> Option<f32> {
    let all = [dx[0], dx[1], dy[0], dy[1]];
    if all.iter().any(|g| !g.is_finite()) {
        return Some(COARSEST);
    }
    all.iter().all(|&g| g == 0.0).then_some(FINEST)
}

/// What a pixel covers; `dx` and `dy` are texels of level 0 along one pixel.
fn footprint(dx: [f32; 2], dy: [f32; 2], max_taps: u32) -> Footprint {
    if let Some(lambda) = degenerate_lambda(dx, dy) {
        return Footprint { lambda, axis: [0.0; 2] };
    }
    if max_taps == 1 {
        let square = |g: [f32; 2]| g[0] * g[0] + g[1] * g[1];
        let lambda = 0.5 * square(dx).max(square(dy)).clamp(1e-30, 1e30).log2();
        return Footprint { lambda, axis: [0.0; 2] };
    }
    ellipse(dx, dy, max_taps as f32)
}

/// The ellipse of which these are two radii, in units of the largest of them.
fn ellipse(dx: [f32; 2], dy: [f32; 2], max_taps: f32) -> Footprint {
    let unit = [dx, dy].as_flattened().iter().fold(0.0f32, |most, g| most.max(g.abs())).clamp(1e-15, 1e15);
    let [x, y] = [dx, dy].map(|g| g.map(|g| (g / unit).clamp(-1.0, 1.0)));
    let squares = [0, 1].map(|a| x[a] * x[a] + y[a] * y[a]);
    let mixed = x[0] * x[1] + y[0] * y[1];
    let half_difference = 0.5 * (squares[0] - squares[1]);
    let root = (half_difference * half_difference + mixed * mixed).sqrt();
    let longer_squared = (0.5 * (squares[0] + squares[1]) + root).max(1e-30);
    let area = x[0] * y[1] - x[1] * y[0];
    let rho_squared = (area * area / longer_squared).max(longer_squared / (max_taps * max_taps));
    let longer = match half_difference < 0.0 {
        true => [mixed, root - half_difference + 1e-15],
        false => [half_difference + root + 1e-15, mixed],
    };
    let to_length = longer_squared.sqrt() * unit / (longer[0] * longer[0] + longer[1] * longer[1]).sqrt();
    Footprint { lambda: unit.log2() + 0.5 * rho_squared.log2(), axis: longer.map(|side| side * to_length) }
}

impl Footprint {
    /// Of an explicit level.
    pub(super) fn of_level(level: f32) -> Footprint {
        Footprint { lambda: level, axis: [0.0; 2] }
    }

    /// Where each of the taps lies that it takes at a level, from the middle.
    pub(super) fn taps(self, level: f32, max_taps: u32) -> impl Iterator<Item = [f32; 2]> {
        let texels = self.axis[0].hypot(self.axis[1]) * (-level).exp2();
        let taps = (texels - 0.0625).ceil().clamp(1.0, max_taps as f32);
        (0..taps as u32).map(move |nth| self.axis.map(|axis| axis * ((nth as f32 + 0.5) / taps - 0.5)))
    }
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
        self.footprint(self.texels(ddx), self.texels(ddy)).lambda
    }

    /// What a pixel covers, from gradients in texels of level 0.
    pub(super) fn footprint(&self, dx: [f32; 2], dy: [f32; 2]) -> Footprint {
        footprint(dx, dy, self.filter.max_taps())
    }

    pub(super) fn texels(&self, uv: [f32; 2]) -> [f32; 2] {
        let size = self.geometry.size();
        [0, 1].map(|a| uv[a] * size[a] as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: f32, expected: f32) {
        assert!((found - expected).abs() < 1e-4 * expected.abs().max(1.0), "{found}, not {expected}");
    }

    #[test]
    fn the_shorter_axis_says_the_level_and_taps_lie_along_the_longer_one() {
        // 12 texels by 3, turned by any angle, and seen from pixels that are turned by another.
        for turn in [0.0, 0.3, 0.785, 1.2, 1.571, 2.0, 3.0_f32] {
            for pixel in [0.0, 0.4, 0.785, 1.571_f32] {
                let (along, across) =
                    ([turn.cos() * 12.0, turn.sin() * 12.0], [-turn.sin() * 3.0, turn.cos() * 3.0]);
                let mixed = |a: f32, b: f32| [0, 1].map(|n| a * along[n] + b * across[n]);
                let (dx, dy) = (mixed(pixel.cos(), pixel.sin()), mixed(-pixel.sin(), pixel.cos()));
                let found = footprint(dx, dy, 16);
                assert_near(found.lambda, 3.0_f32.log2());
                assert_near(found.axis[0].hypot(found.axis[1]), 12.0);
                assert_near(found.axis[0] * along[1], found.axis[1] * along[0]);
                assert_eq!(found.taps(found.lambda, 16).count(), 4);
                // Two taps are a third as sharp as is needed; a coarser level takes fewer.
                assert_near(footprint(dx, dy, 2).lambda, 6.0_f32.log2());
                assert_eq!(found.taps(found.lambda + 1.0, 16).count(), 2);
            }
        }
    }

    #[test]
    fn gradients_of_any_size_have_an_axis() {
        for size in [1e-38, 1e-20, 1e-8, 1.0, 1e8, 1e20, 3e38_f32] {
            for (dx, dy) in [
                ([1.0, 0.0], [0.0, 0.0]),
                ([0.6, 0.8], [0.8, -0.6]),
                ([0.0, 1.0], [0.0, -1.0]),
                ([0.5, 0.5], [0.5, 0.5]),
            ] {
                let found = footprint(dx.map(|g: f32| g * size), dy.map(|g: f32| g * size), 8);
                assert!(
                    found.lambda.is_finite() && found.axis.iter().all(|a| a.is_finite()),
                    "{size} {dx:?}: {found:?}"
                );
                assert!((1..=8).contains(&found.taps(0.0, 8).count()));
            }
        }
        assert!(footprint([0.0; 2], [0.0; 2], 8).lambda < -1000.0);
        assert!(footprint([f32::NAN, 0.0], [1.0; 2], 8).lambda > 1000.0);
    }
}
