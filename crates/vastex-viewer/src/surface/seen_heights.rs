//! The heights of a scene, as the moves of a camera ask for them: as far as the CPU knows them.

use glam::DVec2;
use vastex::Textures;

use super::heights_ray::HeightsBelow;
use super::relief::ReliefSurface;
use super::renderer::SceneRenderer;
use crate::camera::{GroundHeights, Pose};

/// The heights that displace a scene. Made by [`SceneRenderer::heights`].
pub struct SeenHeights<'a> {
    surface: &'a ReliefSurface,
    textures: &'a Textures,
    picture: [u32; 2],
    aspect: f64,
}

impl SceneRenderer {
    /// The heights that displace the scene, as they are seen in a picture of so many pixels; `None` where
    /// nothing is displaced. For [`crate::camera::Controller::apply_over`].
    pub fn heights<'a>(&'a self, textures: &'a Textures, picture: [u32; 2]) -> Option<SeenHeights<'a>> {
        let surface = self.relief().filter(|surface| !surface.is_level())?;
        let picture = self.view_in(picture).whole;
        Some(SeenHeights { surface, textures, picture, aspect: self.image_aspect() })
    }
}

impl SeenHeights<'_> {
    fn seen_from(&self, pose: &Pose) -> Option<HeightsBelow<'_>> {
        HeightsBelow::new(self.surface, self.textures, pose, (self.picture, self.aspect), 1.0)
    }
}

impl GroundHeights for SeenHeights<'_> {
    fn below(&mut self, pose: &Pose) -> f64 {
        self.seen_from(pose).map_or(0.0, |heights| heights.raised())
    }

    fn distance(&mut self, pose: &Pose, point: DVec2) -> Option<f64> {
        let ray = pose.ray(point)?;
        let (distance, _) = self.seen_from(pose)?.met_by(&ray)?;
        Some(distance)
    }
}
