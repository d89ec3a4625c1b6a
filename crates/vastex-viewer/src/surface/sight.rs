//! Which place of the image a pixel of a picture shows, on every surface. In f64, from the camera's pose.

use glam::DVec2;
use vastex::Textures;

use super::heights_ray::HeightsBelow;
use super::patches::PIXELS_PER_QUAD;
use super::renderer::SceneRenderer;
use super::tiling::Tiling;
use crate::camera::{Ground, ImagePlacement, Pose};
use crate::picture::PicturePart;

/// What a pixel shows of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPlace {
    /// The place, in texels of level 0 of the image from its first corner.
    pub texel: DVec2,
    /// How many of these texels a pixel covers along the shorter side of what it covers.
    pub texels_a_pixel: f64,
}

/// A picture of a scene, to ask what its pixels show.
#[derive(Debug)]
pub struct Sight<'a> {
    seen: Seen<'a>,
    /// The picture, as a part of what the camera sees.
    view: PicturePart,
    image: [u32; 2],
    pose: Pose,
}

/// Upon what the image lies.
#[derive(Debug)]
enum Seen<'a> {
    Nothing,
    Image(ImagePlacement),
    Ground(Ground),
    Heights(Ground, Box<HeightsBelow<'a>>),
}

impl SceneRenderer {
    /// What pixels of a picture of `picture` pixels show to a camera at a pose, of an image of `image`
    /// texels, of which the texture may have fewer. Costs as little as a texel of the heights.
    pub fn sight<'a>(
        &'a self,
        textures: &'a Textures,
        pose: &Pose,
        (picture, image): ([u32; 2], [u32; 2]),
    ) -> Sight<'a> {
        self.rough_sight(textures, pose, (picture, image), 1.0)
    }

    /// As [`SceneRenderer::sight`], for pixels that are so many apart: what heights hide or show that are
    /// smaller than that may be missed, and each answer takes as many times less.
    pub fn rough_sight<'a>(
        &'a self,
        textures: &'a Textures,
        pose: &Pose,
        (picture, image): ([u32; 2], [u32; 2]),
        pixels: f64,
    ) -> Sight<'a> {
        let (aspect, relief, view) = (self.image_aspect(), self.relief(), self.view_in(picture));
        let quads = (pixels / f64::from(PIXELS_PER_QUAD)).max(1.0);
        let heights =
            || HeightsBelow::new(relief?, textures, pose, (view.whole, aspect), quads).map(Box::new);
        let seen = match (pose.placement(picture, image), pose.ground(aspect)) {
            // A texture that lies on its surface again and again has no one place for a pixel.
            _ if self.tiling() != Tiling::default() => Seen::Nothing,
            (Some(placed), _) => Seen::Image(placed),
            (None, Some(ground)) => match heights() {
                Some(heights) => Seen::Heights(ground, heights),
                None => Seen::Ground(ground),
            },
            (None, None) => Seen::Nothing,
        };
        Sight { seen, view, image, pose: *pose }
    }
}

impl Sight<'_> {
    /// What is seen at a place of the picture, in pixels from its top left; `None` beside the image, and in
    /// scenes on which textures are repeated.
    ///
    /// Costs less than a microsecond, but over heights one for each step along the ray: some tens of them
    /// looking down, at most some hundreds at a grazing angle.
    pub fn at(&mut self, pixel: DVec2) -> Option<SeenPlace> {
        let size = self.image.map(f64::from);
        let inside = |texel: DVec2| (0..2).all(|axis| (0.0..size[axis]).contains(&texel[axis]));
        if let Seen::Image(placed) = &self.seen {
            let texel = placed.texel(pixel);
            return inside(texel).then_some(SeenPlace { texel, texels_a_pixel: 1.0 / placed.scale });
        }
        let ray = self.pose.ray(self.view.point(pixel))?;
        let (ground, distance, place) = match &mut self.seen {
            Seen::Ground(ground) => {
                let [distance, _] = ground.beneath(&ray, 0.0)?;
                (*ground, distance, ray.at(distance))
            }
            Seen::Heights(ground, heights) => {
                let (distance, place) = heights.met_by(&ray)?;
                (*ground, distance, place)
            }
            Seen::Nothing | Seen::Image(_) => return None,
        };
        let uv = ground.uv(place);
        // The lower edge belongs to a globe, and rounding must not lose a pole.
        let uv = if matches!(ground, Ground::Globe { .. }) { uv.min(DVec2::splat(1.0 - 1e-15)) } else { uv };
        let texel = uv * DVec2::from(size);
        let texels_by_world = (DVec2::from(size) / ground.extent()).min_element();
        let pixel_in_world = distance * ray.ahead * Pose::pixel_at_1(self.view.whole[1]);
        inside(texel).then_some(SeenPlace { texel, texels_a_pixel: pixel_in_world * texels_by_world })
    }

    /// Returns true if each answer is looked for along a ray.
    pub fn is_marched(&self) -> bool {
        matches!(self.seen, Seen::Heights(..))
    }

    /// The least and the largest column and row of the picture between which the image is seen, in pixels:
    /// all of the picture, or the part of it in which an image lies. `None` if none of it is seen.
    pub fn bounds(&self) -> Option<[DVec2; 2]> {
        let (mut low, mut high) = (DVec2::ZERO, DVec2::from(self.view.size.map(f64::from)));
        match &self.seen {
            Seen::Nothing => return None,
            Seen::Ground(_) | Seen::Heights(..) => {}
            Seen::Image(placed) => {
                let [right, bottom] = self.image.map(f64::from);
                let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
                    .map(|(x, y)| placed.pixel(DVec2::new(x, y)));
                low = low.max(corners.into_iter().fold(corners[0], DVec2::min));
                high = high.min(corners.into_iter().fold(corners[0], DVec2::max));
            }
        }
        (low.x < high.x && low.y < high.y).then_some([low, high])
    }
}
