//! How an image lies in a picture of it: which texel is seen at which pixel.

use glam::{DMat2, DVec2};

use super::orientation::Orientation;
use super::pose::Pose;
use crate::picture::PicturePart;

/// Which texel of an image is seen at which pixel of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePlacement {
    /// Pixels along a texel.
    pub scale: f64,
    /// The place in the middle of the picture, in texels.
    centre: DVec2,
    /// The middle of the picture, in pixels.
    middle: DVec2,
    /// The picture's first corner.
    corner: DVec2,
    /// Steps in the image from those that are seen, and the other way round.
    image_from_seen: DMat2,
    seen_from_image: DMat2,
}

impl ImagePlacement {
    /// The place in the image that is seen at a place of the picture, in texels and pixels from their first
    /// corners. It may lie beside the image.
    pub fn texel(&self, pixel: DVec2) -> DVec2 {
        self.centre + self.image_from_seen * (pixel - self.middle) / self.scale
    }

    /// The place of the picture at which a place in the image is seen, in pixels and texels from their first
    /// corners. It may lie beside the picture.
    pub fn pixel(&self, texel: DVec2) -> DVec2 {
        self.middle + self.seen_from_image * (texel - self.centre) * self.scale
    }

    /// The step in the image, in texels, that is seen as one to the right as long as a texel.
    pub fn step_to_the_right(&self) -> DVec2 {
        self.image_from_seen * DVec2::X
    }

    /// The corners of a part of the picture as places in the image, in texels, from its first corner
    /// clockwise as it is seen.
    pub fn corners(&self, low: DVec2, high: DVec2) -> [DVec2; 4] {
        [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)].map(|pixel| self.texel(pixel))
    }

    /// The least and the largest column and row of the image that [`ImagePlacement::corners`] of a part of
    /// the picture lie at, in texels.
    pub fn bounds(&self, low: DVec2, high: DVec2) -> [DVec2; 2] {
        let corners = self.corners(low, high);
        [corners.into_iter().fold(corners[0], DVec2::min), corners.into_iter().fold(corners[0], DVec2::max)]
    }

    /// [`ImagePlacement::bounds`] of the whole picture.
    pub fn seen(&self) -> [DVec2; 2] {
        self.bounds(self.corner, 2.0 * self.middle - self.corner)
    }

    /// This placement where the picture is a part of a larger one, whose pixels are meant from here on. Its
    /// first corner is at the pixel `corner` of that one.
    #[must_use]
    pub fn within(self, corner: DVec2) -> ImagePlacement {
        let moved = corner - self.corner;
        ImagePlacement { middle: self.middle + moved, corner, ..self }
    }
}

impl Pose {
    /// How an image of so many texels lies in a picture of so many pixels; `None` in scenes with
    /// perspective.
    pub fn placement(&self, picture: [u32; 2], image: [u32; 2]) -> Option<ImagePlacement> {
        let Pose::Image { centre, orientation, .. } = *self else { return None };
        let size = |sides: [u32; 2]| DVec2::from(sides.map(f64::from));
        let scale = self.magnification(picture, image)?;
        let (image_from_seen, seen_from_image) =
            (orientation.image_from_seen(), orientation.seen_from_image());
        let (centre, middle) = (centre * size(image), size(picture) / 2.0);
        let corner = DVec2::ZERO;
        Some(ImagePlacement { scale, centre, middle, corner, image_from_seen, seen_from_image })
    }

    /// This camera over an image that is turned otherwise, its texels as large as before; one that shows
    /// all of the image goes on to do so. `view` and `image` are width over height. Nothing changes in scenes
    /// with perspective.
    #[must_use]
    pub fn with_orientation(self, orientation: Orientation, view: f64, image: f64) -> Pose {
        let Pose::Image { centre, zoom, .. } = self else { return self };
        let turned = Pose::Image { centre, zoom, orientation };
        let share = turned.view_height(view, image) / self.view_height(view, image);
        let zoom = if zoom == 1.0 { zoom } else { zoom * share };
        Pose::Image { centre, zoom, orientation }
    }

    /// The pose by which a part of a picture shows what it is of the whole, of an image of so many texels.
    /// One of a scene with perspective, whose view is divided itself, stays.
    #[must_use]
    pub fn in_part(self, part: &PicturePart, image: [u32; 2]) -> Pose {
        let (Some(placed), Pose::Image { zoom, orientation, .. }) = (self.placement(part.whole, image), self)
        else {
            return self;
        };
        if *part == PicturePart::all(part.whole) {
            return self;
        }
        let at = DVec2::new(part.at[0] as f64, part.at[1] as f64);
        let middle = at + DVec2::from(part.size.map(f64::from)) / 2.0;
        let centre = placed.texel(middle) / DVec2::from(image.map(f64::from));
        let there = Pose::Image { centre, zoom, orientation };
        let scale = there.magnification(part.size, image).unwrap_or(placed.scale);
        Pose::Image { centre, zoom: zoom * placed.scale / scale, orientation }
    }

    /// How an image is turned: as it is stored in scenes with perspective.
    pub fn orientation(&self) -> Orientation {
        match *self {
            Pose::Image { orientation, .. } => orientation,
            Pose::Plane { .. } | Pose::Globe { .. } => Orientation::UPRIGHT,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_turned_and_mirrored_comes_back() {
        let size = [1000, 500];
        for (degrees, is_mirrored) in
            [(0.0, false), (90.0, false), (200.0, true), (359.9, true), (33.3, false)]
        {
            let orientation = Orientation::new(degrees, is_mirrored);
            let pose = Pose::Image { centre: DVec2::new(0.3, 0.6), zoom: 3.0, orientation };
            let placed = pose.placement([640, 480], size).unwrap();
            assert_eq!(placed.texel(DVec2::new(320.0, 240.0)), DVec2::new(300.0, 300.0));
            let texel = DVec2::new(17.25, 400.5);
            assert!((placed.texel(placed.pixel(texel)) - texel).length() < 1e-9, "{orientation:?}");
        }
    }

    #[test]
    fn a_part_of_a_picture_shows_the_same_further_to_the_right() {
        let pose = Pose::image(DVec2::new(0.3, 0.6), 3.0);
        let alone = pose.placement([640, 480], [1000, 500]).unwrap();
        let part = alone.within(DVec2::new(640.0, 0.0));
        let texel = DVec2::new(17.25, 400.5);
        assert_eq!(part.pixel(texel), alone.pixel(texel) + DVec2::new(640.0, 0.0));
        assert_eq!((part.seen(), part.within(DVec2::ZERO)), (alone.seen(), alone));
    }

    #[test]
    fn a_part_shows_what_it_is_of_the_whole() {
        let (whole, image) = ([1000, 700], [5000, 3000]);
        for (degrees, is_mirrored) in [(0.0, false), (90.0, true), (33.0, false)] {
            let orientation = Orientation::new(degrees, is_mirrored);
            let pose = Pose::Image { centre: DVec2::new(0.3, 0.6), zoom: 3.0, orientation };
            let placed = pose.placement(whole, image).unwrap();
            for at in [[0, 0], [-32, 236], [700, 468]] {
                let part = PicturePart { whole, at, size: [300, 264] };
                let there = pose.in_part(&part, image).placement(part.size, image).unwrap();
                for pixel in [DVec2::ZERO, DVec2::new(17.5, 201.0)] {
                    let expected = placed.texel(pixel + DVec2::new(at[0] as f64, at[1] as f64));
                    assert!(there.texel(pixel).distance(expected) < 1e-6, "{part:?} {pixel}");
                }
            }
        }
        let globe = Pose::first(crate::Scene::Globe);
        assert_eq!(globe.in_part(&PicturePart { whole, at: [0; 2], size: [8; 2] }, image), globe);
    }

    #[test]
    fn an_image_that_fits_fits_when_it_is_turned_and_texels_stay_as_large_else() {
        let (view, picture, image) = (2.0, [800, 400], [1000, 500]);
        let whole = Pose::image(DVec2::splat(0.5), 1.0);
        let turned = whole.with_orientation(Orientation::new(90.0, false), view, 2.0);
        let [low, high] = turned.placement(picture, image).unwrap().seen();
        assert!((low.x, high.x) == (0.0, 1000.0), "{low} {high}");
        let near = Pose::image(DVec2::splat(0.25), 7.0);
        for degrees in [90.0, 45.0, 180.0] {
            let turned = near.with_orientation(Orientation::new(degrees, true), view, 2.0);
            let scale = |pose: Pose| pose.magnification(picture, image).unwrap();
            assert!((scale(turned) / scale(near) - 1.0).abs() < 1e-12, "{degrees}");
        }
    }
}
