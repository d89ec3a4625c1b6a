//! The poles of a globe with heights. A pole is one point and has one height, the mean of those around it;
//! within half a texel of the level that is drawn there heights go straight to it, so that the ground has no
//! step on the way. The twin of `relief_share` and `relief_around` in relief.wgsl.

use glam::DVec2;

/// Places of a row of texels, evenly spread, whose mean is the height of a pole: exactly that of the row
/// where heights go up and down fewer times than that.
pub(super) const AROUND: u32 = 8;

/// How high a globe is at a uv: from how high its texels say that it is there and beside the nearer pole.
/// Heights have so many rows of texels, and are drawn at a level, which may be below 0.
pub(super) fn height_on_globe(uv: DVec2, level: f64, rows: u32, mut height: impl FnMut(DVec2) -> f64) -> f64 {
    let here = height(uv);
    let from_pole = uv.y.min(1.0 - uv.y).max(0.0) * f64::from(rows);
    let share = from_pole * (1.0 - level.max(0.0)).exp2();
    if share >= 1.0 {
        return here;
    }
    let first = 0.5 / f64::from(rows);
    let row = if uv.y < 0.5 { first } else { 1.0 - first };
    let around = (0..AROUND).map(|n| DVec2::new((f64::from(n) + 0.5) / f64::from(AROUND), row));
    let mean = around.map(height).sum::<f64>() / f64::from(AROUND);
    mean + (here - mean) * share
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_pole_has_one_height_and_the_way_there_no_step() {
        const ROWS: u32 = 64;
        // As different as a texture can have it along a meridian that ends there.
        let tilted = |uv: DVec2| 0.3 + 0.1 * (TAU * uv.x).sin() + 0.02 * (3.0 * TAU * uv.x).cos();
        for (level, half) in [(-3.0, 0.5), (0.0, 0.5), (2.0, 2.0)] {
            let at = |u: f64, from_pole: f64, is_north: bool| {
                let v = from_pole / f64::from(ROWS);
                height_on_globe(DVec2::new(u, if is_north { v } else { 1.0 - v }), level, ROWS, tilted)
            };
            for (is_north, u) in
                [true, false].into_iter().flat_map(|is_north| [0.0, 0.2, 0.9].map(|u| (is_north, u)))
            {
                let value = tilted(DVec2::new(u, 0.0));
                assert!((at(u, 0.0, is_north) - 0.3).abs() < 1e-12, "{level}");
                assert!((at(u, half / 2.0, is_north) - (0.3 + value) / 2.0).abs() < 1e-9, "{level}");
                assert!((at(u, 0.9999 * half, is_north) - value).abs() < 1e-4, "{level}");
                assert_eq!(at(u, half, is_north), value, "{level}");
            }
        }
    }

    #[test]
    fn far_from_poles_nothing_else_is_asked() {
        let mut asked = 0;
        let height = height_on_globe(DVec2::new(0.1, 0.3), 1.0, 1000, |_| {
            asked += 1;
            0.25
        });
        assert_eq!((height, asked), (0.25, 1));
    }
}
