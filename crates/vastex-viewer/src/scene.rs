//! Which scenes there are: the kinds of surface that a texture can be put on.

use glam::{DVec3, Vec3};

/// What a texture is put on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scene {
    /// Nothing: the image itself, to pan and zoom.
    Image,
    /// A rectangle on the ground, in perspective.
    Plane,
    /// A sphere, the image in plate carrée projection.
    Globe,
    /// The rectangle, displaced by heights of the texture.
    Terrain,
    /// The sphere under a sun, displaced by heights if there are any, with air around it, and lights and
    /// clouds if there are any.
    Planet,
}

impl Scene {
    /// Every scene.
    pub const ALL: [Scene; 5] = [Scene::Image, Scene::Plane, Scene::Globe, Scene::Terrain, Scene::Planet];
    /// The scenes that a texture without heights goes on and that show its colours as they are.
    pub const SMOOTH: [Scene; 3] = [Scene::Image, Scene::Plane, Scene::Globe];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scene::Image => "image",
            Scene::Plane => "plane",
            Scene::Globe => "globe",
            Scene::Terrain => "terrain",
            Scene::Planet => "planet",
        }
    }

    /// Returns true if the scene is a sphere, so that the image's left and right edges are neighbours.
    pub fn is_round(self) -> bool {
        matches!(self, Scene::Globe | Scene::Planet)
    }
}

/// The point of the unit sphere at a longitude and latitude.
pub(crate) fn direction_f64(longitude: f64, latitude: f64) -> DVec3 {
    DVec3::new(longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin())
}

/// The point of the unit sphere at a longitude and latitude, in radians.
pub fn direction(longitude: f32, latitude: f32) -> Vec3 {
    Vec3::new(longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin())
}
