//! Surfaces as a survey sees them: where a rectangle of the texture lies in the world, and how large it is
//! there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::wanted::vector::{cross, dot, length};

/// A rectangle of a texture: its first corner and the one opposite, in uv from 0 to 1.
pub type UvBox = [[f64; 2]; 2];

/// What a survey knows of the part of a surface that shows a rectangle of its texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The point of the surface in the middle of the rectangle.
    pub centre: [f64; 3],
    /// Radius of a sphere around it that holds the whole patch.
    pub radius: f64,
    /// The direction and the length, in the world, of one unit of u and of v at the centre.
    pub along: [[f64; 3]; 2],
    /// How many times longer than that they may be elsewhere in the patch; 1 where they are the same
    /// everywhere.
    pub stretch: f64,
    /// Angle in radians by which the surface may be turned against its position at the centre.
    pub bend: f64,
    /// The side from which it is seen, as a direction at the centre; `None` if it is seen from both.
    pub facing: Option<[f64; 3]>,
}

/// A surface with a texture on it. Patches of nested rectangles should shrink with them, since a survey goes
/// down until it knows enough.
pub trait Surface {
    /// The patch that shows a rectangle of the texture. May be larger than it is, never smaller.
    fn patch(&self, uv: UvBox) -> Patch;
}

/// A parallelogram: an image, ground, or terrain above it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatSurface {
    /// Where uv is 0, 0.
    pub origin: [f64; 3],
    /// The direction and the length of the sides along u and v.
    pub along: [[f64; 3]; 2],
    /// How far the surface may lie above or below the plane; 0 where it is flat.
    pub relief: f64,
    /// The surface's steepest slope against the plane, in radians, below a right angle.
    pub slope: f64,
}

impl FlatSurface {
    /// A flat one.
    pub fn new(origin: [f64; 3], along: [[f64; 3]; 2]) -> FlatSurface {
        FlatSurface { origin, along, relief: 0.0, slope: 0.0 }
    }
}

impl Surface for FlatSurface {
    fn patch(&self, uv: UvBox) -> Patch {
        let [u, v] = self.along;
        let half = [0, 1].map(|axis| (uv[1][axis] - uv[0][axis]) / 2.0);
        let middle = [0, 1].map(|axis| (uv[0][axis] + uv[1][axis]) / 2.0);
        let at = |a: f64, b: f64| std::array::from_fn(|axis| a * u[axis] + b * v[axis]);
        let diagonal = length(at(half[0], half[1])).max(length(at(half[0], -half[1])));
        let from_origin: [f64; 3] = at(middle[0], middle[1]);
        Patch {
            centre: std::array::from_fn(|axis| self.origin[axis] + from_origin[axis]),
            radius: diagonal + self.relief,
            along: self.along,
            stretch: 1.0 / self.slope.clamp(0.0, 1.57).cos(),
            bend: self.slope,
            facing: None,
        }
    }
}

/// A sphere or an ellipsoid with a texture in plate carrée projection: u is the longitude, from -180 to 180
/// degrees, v the latitude, from north to south. Seen from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobeSurface {
    /// The globe's centre.
    pub centre: [f64; 3],
    /// Radii along x (longitude 0), y (90 degrees east) and z (north).
    pub radii: [f64; 3],
}

impl GlobeSurface {
    /// A sphere.
    pub fn sphere(centre: [f64; 3], radius: f64) -> GlobeSurface {
        GlobeSurface { centre, radii: [radius; 3] }
    }
}

impl Surface for GlobeSurface {
    fn patch(&self, uv: UvBox) -> Patch {
        let half = [(uv[1][0] - uv[0][0]) / 2.0 * TAU, (uv[1][1] - uv[0][1]) / 2.0 * PI];
        let longitude = ((uv[0][0] + uv[1][0]) / 2.0 - 0.5) * TAU;
        let latitude = (0.5 - (uv[0][1] + uv[1][1]) / 2.0) * PI;
        let (sin_lon, cos_lon) = longitude.sin_cos();
        let (sin_lat, cos_lat) = latitude.sin_cos();
        // The parallel nearest the equator is the longest.
        let widest = (latitude.abs() - half[1]).clamp(0.0, FRAC_PI_2).cos();
        let (across, down) = ((half[0].min(PI) / 2.0).sin(), (half[1].min(PI) / 2.0).sin());
        // Half the chord, on the unit sphere, from the centre to a point that nothing of the patch is beyond.
        let half_chord = (down * down + cos_lat * widest * across * across).sqrt().min(1.0);
        let (longest, shortest) = self
            .radii
            .iter()
            .fold((0f64, f64::INFINITY), |(long, short), &radius| (long.max(radius), short.min(radius)));
        let flattening = longest / shortest.max(f64::MIN_POSITIVE);
        let scaled = |direction: [f64; 3]| std::array::from_fn(|axis| direction[axis] * self.radii[axis]);
        let east = [-sin_lon * cos_lat * TAU, cos_lon * cos_lat * TAU, 0.0];
        let south = [sin_lat * cos_lon * PI, sin_lat * sin_lon * PI, -cos_lat * PI];
        let out: [f64; 3] = scaled([cos_lon * cos_lat, sin_lon * cos_lat, sin_lat]);
        let along: [[f64; 3]; 2] = [scaled(east), scaled(south)];
        let normal = cross(along[1], along[0]);
        Patch {
            centre: std::array::from_fn(|axis| self.centre[axis] + out[axis]),
            radius: 2.0 * longest * half_chord,
            along,
            stretch: widest / cos_lat.max(1e-9) * flattening,
            bend: (2.0 * half_chord.asin() * flattening * flattening).min(PI),
            facing: Some(if dot(normal, out) < 0.0 { normal.map(|n| -n) } else { normal }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wanted::vector::{angle, sub_scaled};
    use proptest::prelude::*;

    fn on_globe(globe: &GlobeSurface, [u, v]: [f64; 2]) -> [f64; 3] {
        let (longitude, latitude) = ((u - 0.5) * TAU, (0.5 - v) * PI);
        let unit = [longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin()];
        std::array::from_fn(|axis| globe.centre[axis] + globe.radii[axis] * unit[axis])
    }

    fn normal(globe: &GlobeSurface, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| (point[axis] - globe.centre[axis]) / globe.radii[axis].powi(2))
    }

    proptest! {
        #[test]
        fn a_patch_of_a_globe_holds_all_its_points_and_their_normals(
            corner in prop::array::uniform2(0.0f64..1.0),
            extent in prop::array::uniform2(0.0f64..1.0),
            inside in prop::array::uniform2(0.0f64..=1.0),
            polar in 0.8f64..1.25,
        ) {
            let globe = GlobeSurface { centre: [1.0, 2.0, 3.0], radii: [2.0, 2.0, 2.0 * polar] };
            let end = [0, 1].map(|a| corner[a] + (1.0 - corner[a]) * extent[a]);
            let patch = globe.patch([corner, end]);
            let at = [0, 1].map(|a| corner[a] + (end[a] - corner[a]) * inside[a]);
            let point = on_globe(&globe, at);
            prop_assert!(length(sub_scaled(point, 1.0, patch.centre)) <= patch.radius + 1e-9);
            let turned = angle(normal(&globe, point), patch.facing.unwrap());
            prop_assert!(turned <= patch.bend + 1e-6, "{turned} > {}", patch.bend);
            for axis in 0..2 {
                // The length of a short step, against what the patch allows.
                let step = 1e-6;
                let mut next = at;
                next[axis] += if at[axis] < 0.5 { step } else { -step };
                let moved = length(sub_scaled(on_globe(&globe, next), 1.0, point)) / step;
                let most = patch.stretch * length(patch.along[axis]);
                prop_assert!(moved <= most * 1.001 + 1e-3, "{axis}: {moved} > {most}");
            }
        }

        #[test]
        fn a_patch_of_a_plane_holds_its_corners(
            u in prop::array::uniform3(-2.0f64..2.0), v in prop::array::uniform3(-2.0f64..2.0),
            a in prop::array::uniform2(0.0f64..1.0), b in prop::array::uniform2(0.0f64..1.0),
        ) {
            let flat = FlatSurface::new([1.0, 0.0, 2.0], [u, v]);
            let uv = [[a[0].min(b[0]), a[1].min(b[1])], [a[0].max(b[0]), a[1].max(b[1])]];
            let patch = flat.patch(uv);
            for corner in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                let [s, t] = [uv[corner[0]][0], uv[corner[1]][1]];
                let point = std::array::from_fn(|n| flat.origin[n] + s * u[n] + t * v[n]);
                prop_assert!(length(sub_scaled(point, 1.0, patch.centre)) <= patch.radius + 1e-9);
            }
        }
    }
}
