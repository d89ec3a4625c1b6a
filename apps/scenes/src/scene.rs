//! The scenes, and the surfaces that they put a texture on.

use glam::{Vec2, Vec3};

use crate::pose::direction;

/// What a texture is put on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scene {
    /// Nothing: the image itself, to pan and zoom.
    Image,
    /// A rectangle on the ground, in perspective.
    Plane,
    /// A sphere, the image in plate carrée projection.
    Globe,
}

impl Scene {
    /// Every scene.
    pub const ALL: [Scene; 3] = [Scene::Image, Scene::Plane, Scene::Globe];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scene::Image => "image",
            Scene::Plane => "plane",
            Scene::Globe => "globe",
        }
    }
}

/// A point of a surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// In the world.
    pub position: Vec3,
    /// In the virtual texture.
    pub uv: Vec2,
}

/// Quads of the globe round the equator and from pole to pole.
const GLOBE_QUADS: [u32; 2] = [384, 192];

/// The triangles of a scene's surface, every three vertices one, for an image of `image` (width over height).
pub fn surface(scene: Scene, image: f32) -> Vec<Vertex> {
    match scene {
        Scene::Image | Scene::Plane => {
            grid([1, 1], |uv| Vec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0))
        }
        Scene::Globe => grid(GLOBE_QUADS, |uv| {
            let (longitude, latitude) =
                ((uv.x - 0.5) * std::f32::consts::TAU, (0.5 - uv.y) * std::f32::consts::PI);
            direction(longitude, latitude)
        }),
    }
}

fn grid(quads: [u32; 2], position_from_uv: impl Fn(Vec2) -> Vec3) -> Vec<Vertex> {
    let vertex = |x: u32, y: u32| {
        let uv = Vec2::new(x as f32 / quads[0] as f32, y as f32 / quads[1] as f32);
        Vertex { position: position_from_uv(uv), uv }
    };
    let mut vertices = Vec::with_capacity((6 * quads[0] * quads[1]) as usize);
    for y in 0..quads[1] {
        for x in 0..quads[0] {
            let [a, b, c, d] = [vertex(x, y), vertex(x, y + 1), vertex(x + 1, y), vertex(x + 1, y + 1)];
            vertices.extend([a, b, c, c, b, d]);
        }
    }
    vertices
}
