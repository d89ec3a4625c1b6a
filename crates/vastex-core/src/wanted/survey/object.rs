//! Objects by their distance: all of an object's texture at the level that its nearest point needs.

use super::camera::Camera;
use super::look::{Footprint, feedback_pixels};
use super::surface::{Surface, UvBox};
use crate::wanted::vector::length;

/// An object, or a part of one, with a region of a texture on it.
///
/// Which part of it is near is not known, so all of the region is wanted at one level. That suits objects
/// that are small against their distance; others are better cut into parts ([`SurveyedObject::grid`]), or
/// surveyed as a [`Surface`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurveyedObject {
    /// The middle of a sphere around it.
    pub centre: [f64; 3],
    /// Radius of that sphere.
    pub radius: f64,
    /// The region of the texture that it shows.
    pub uv: UvBox,
    /// Texels of level 0 along one unit of the world, where they lie least densely.
    pub texels_per_unit: f64,
}

impl SurveyedObject {
    /// The parts of a surface with a texture of `size` texels, cut into so many columns and rows of uv.
    pub fn grid(surface: &dyn Surface, size: [u32; 2], parts: [u32; 2]) -> Vec<SurveyedObject> {
        let edge = |axis: usize, nth: u32| f64::from(nth) / f64::from(parts[axis].max(1));
        let cells = (0..parts[1]).flat_map(|y| (0..parts[0]).map(move |x| [x, y]));
        let part = |[x, y]: [u32; 2]| {
            let uv = [[edge(0, x), edge(1, y)], [edge(0, x + 1), edge(1, y + 1)]];
            let patch = surface.patch(uv);
            // Texels are counted along the axis that has more of them, since that decides the level.
            let texels = |axis: usize| f64::from(size[axis]) / (length(patch.along[axis]) * patch.stretch);
            let texels_per_unit = texels(0).max(texels(1));
            SurveyedObject { centre: patch.centre, radius: patch.radius, uv, texels_per_unit }
        };
        cells.map(part).collect()
    }
}

impl Camera {
    /// Looks at an object.
    pub(super) fn look_at_object(&self, object: &SurveyedObject) -> Footprint {
        let is_seen = self.sees(object.centre, object.radius);
        let nearest = match is_seen {
            true => self.nearest_w(object.centre, object.radius),
            false => self.nearest_w_turned(object.centre, object.radius),
        };
        let most = self.pixels();
        if nearest <= 0.0 {
            return Footprint { lambda: f64::NEG_INFINITY, pixels: feedback_pixels(most), is_seen };
        }
        let density = self.focal() / nearest;
        let narrowing = if is_seen { self.narrowing(object.centre, object.radius) } else { 1.0 };
        let lambda = (object.texels_per_unit / density * narrowing).log2();
        let pixels = feedback_pixels((std::f64::consts::PI * (object.radius * density).powi(2)).min(most));
        Footprint { lambda: if lambda.is_nan() { f64::INFINITY } else { lambda }, pixels, is_seen }
    }
}
