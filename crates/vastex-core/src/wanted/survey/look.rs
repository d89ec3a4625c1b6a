//! How sharply a camera wants a patch of a surface, and over how many pixels.
//!
//! The level of a point follows from the gradients there, as on the GPU. For a patch it is worked out at the
//! centre and then made as sharp as any of its points can need: nearer by the radius, turned towards the eye
//! by the bend, larger by the stretch. A bound that knows nothing of how the patch is turned stands below,
//! for patches that are large or near.

use super::camera::Camera;
use super::surface::{Patch, Surface, UvBox};
use crate::shader_constants::FEEDBACK_SCALE;
use crate::wanted::vector::{Vec3, angle, cross, length};

/// Half angle in radians up to which the gradients at the centre of a patch say anything of the rest.
const LOCAL: f64 = 0.6;
/// Half angle and bend in radians from which on a patch is cut into four, to be looked at more closely, and
/// how often.
const CUT_FROM: f64 = 0.2;
const CUTS: u32 = 2;

/// What a camera wants of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Footprint {
    /// The sharpest level that any point needs, before any rule; negative where texels are larger than
    /// pixels.
    pub(super) lambda: f64,
    /// Feedback pixels that it covers; where it is not seen, that it would cover.
    pub(super) pixels: f64,
    /// True if it may be in the view and turned towards the eye.
    pub(super) is_seen: bool,
}

impl Footprint {
    /// What two parts need together, of which both or neither are seen.
    pub(super) fn with(self, other: Footprint) -> Footprint {
        let lambda = self.lambda.min(other.lambda);
        Footprint { lambda, pixels: self.pixels + other.pixels, is_seen: self.is_seen }
    }
}

impl Camera {
    /// Looks at the part of a surface that shows the rectangle `uv` of a texture of `size` texels. Where some
    /// of it is seen, says what that needs.
    pub(super) fn look(&self, surface: &dyn Surface, uv: UvBox, size: [f64; 2]) -> Footprint {
        self.look_closely(surface, uv, size, CUTS)
    }

    fn look_closely(&self, surface: &dyn Surface, uv: UvBox, size: [f64; 2], cuts: u32) -> Footprint {
        let patch = surface.patch(uv);
        let look = self.look_at_patch(&patch, uv, size);
        let is_small = patch.bend.max(self.half_angle(patch.centre, patch.radius)) < CUT_FROM;
        if cuts == 0 || is_small || !look.is_seen {
            return look;
        }
        let [first, last] = uv;
        let middle = [0, 1].map(|axis| (first[axis] + last[axis]) / 2.0);
        let part = |x: usize, y: usize| {
            let edges = |axis: usize, nth: usize| [first[axis], middle[axis], last[axis]][nth];
            let uv = [[edges(0, x), edges(1, y)], [edges(0, x + 1), edges(1, y + 1)]];
            self.look_closely(surface, uv, size, cuts - 1)
        };
        let parts = [part(0, 0), part(1, 0), part(0, 1), part(1, 1)];
        let any_seen = parts.iter().any(|part| part.is_seen);
        let of_kind = parts.into_iter().filter(|part| part.is_seen == any_seen);
        of_kind.reduce(Footprint::with).unwrap_or(look)
    }

    /// Looks at a patch as a whole.
    fn look_at_patch(&self, patch: &Patch, uv: UvBox, size: [f64; 2]) -> Footprint {
        let is_seen = self.sees(patch.centre, patch.radius) && !self.is_turned_away(patch);
        let nearest = match is_seen {
            true => self.nearest_w(patch.centre, patch.radius),
            false => self.nearest_w_turned(patch.centre, patch.radius),
        };
        let area = (uv[1][0] - uv[0][0]) * (uv[1][1] - uv[0][1]);
        let most = self.pixels();
        // The eye is within the sphere, or nearly: as sharp as can be, until smaller patches tell more.
        let near = Footprint { lambda: f64::NEG_INFINITY, pixels: feedback_pixels(most), is_seen };
        if nearest <= 0.0 {
            return near;
        }
        let narrowing = if is_seen { self.narrowing(patch.centre, patch.radius) } else { 1.0 };
        let across = narrowing * self.texels_across(patch, nearest, size);
        let at_centre = if is_seen { self.gradients(patch, size) } else { None };
        let (texels, pixels) = match at_centre {
            Some((texels, pixels)) => {
                let slack = nearest / self.w(patch.centre) / patch.stretch * self.tilt_slack(patch);
                ((texels * slack).max(across), pixels * area)
            }
            None => {
                let density = self.focal() / nearest;
                (across, density * density * length(cross(patch.along[0], patch.along[1])) * area)
            }
        };
        let lambda = texels.log2();
        // What cannot be told, as where a side has no length, is not wanted sharply.
        let lambda = if lambda.is_nan() { f64::INFINITY } else { lambda };
        Footprint { lambda, pixels: feedback_pixels(pixels.min(most)), is_seen }
    }

    /// Texels along a pixel at clip w `nearest`, if the patch faces the eye in the middle of the view: none
    /// of its points has fewer.
    fn texels_across(&self, patch: &Patch, nearest: f64, size: [f64; 2]) -> f64 {
        let density = self.focal() / nearest;
        let [u, v] = [0, 1].map(|axis| size[axis] / (length(patch.along[axis]) * patch.stretch * density));
        ((u * u + v * v) / 2.0).sqrt()
    }

    /// Away from the middle of the view a pixel is narrower in one direction; by how much fewer texels a
    /// point of a sphere may need for that.
    pub(super) fn narrowing(&self, centre: Vec3, radius: f64) -> f64 {
        let aside = self.off_axis(centre) + self.half_angle(centre, radius);
        let cos = aside.min(self.corner_angle()).cos();
        ((1.0 + cos * cos) / 2.0).sqrt()
    }

    /// Texels along a pixel at the centre, by the rule of the shaders, and pixels of the picture on one unit
    /// of uv by uv. `None` if the centre says little of the rest.
    fn gradients(&self, patch: &Patch, size: [f64; 2]) -> Option<(f64, f64)> {
        let in_front = self.w(patch.centre) > patch.radius * self.w_per_unit();
        if !in_front || self.half_angle(patch.centre, patch.radius) > LOCAL {
            return None;
        }
        let [[xu, yu], [xv, yv]] = patch.along.map(|along| self.pixels_along(patch.centre, along));
        let det = xu * yv - xv * yu;
        // uv along a pixel is the inverse of pixels along uv.
        let dx = [yv / det * size[0], -yu / det * size[1]];
        let dy = [-xv / det * size[0], xu / det * size[1]];
        let texels = dx[0].hypot(dx[1]).max(dy[0].hypot(dy[1]));
        texels.is_finite().then_some((texels, det.abs()))
    }

    /// By how much a point that is turned towards the eye more than the centre may need fewer texels along a
    /// pixel.
    fn tilt_slack(&self, patch: &Patch) -> f64 {
        let normal = cross(patch.along[0], patch.along[1]);
        let tilt = angle(normal, self.ray(patch.centre));
        let tilt = tilt.min(std::f64::consts::PI - tilt);
        let least = (tilt - patch.bend - self.half_angle(patch.centre, patch.radius)).max(0.0);
        (tilt.cos() / least.cos()).clamp(0.0, 1.0)
    }

    fn is_turned_away(&self, patch: &Patch) -> bool {
        let (Some(_), Some(facing)) = (self.eye(), patch.facing) else { return false };
        let towards_eye = self.ray(patch.centre).map(|n| -n);
        let spread = patch.bend + self.half_angle(patch.centre, patch.radius);
        angle(facing, towards_eye) - spread > std::f64::consts::FRAC_PI_2
    }
}

/// The feedback pass looks at one pixel of a block.
pub(super) fn feedback_pixels(pixels: f64) -> f64 {
    pixels / f64::from(FEEDBACK_SCALE * FEEDBACK_SCALE)
}
