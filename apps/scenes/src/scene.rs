//! The scenes, and the surfaces that they put a texture on.

use glam::{Vec2, Vec3};

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
}

impl Scene {
    /// Every scene.
    pub const ALL: [Scene; 4] = [Scene::Image, Scene::Plane, Scene::Globe, Scene::Terrain];
    /// Those that a texture without heights goes on.
    pub const SMOOTH: [Scene; 3] = [Scene::Image, Scene::Plane, Scene::Globe];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scene::Image => "image",
            Scene::Plane => "plane",
            Scene::Globe => "globe",
            Scene::Terrain => "terrain",
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
const GLOBE_QUADS: [u32; 2] = [256, 128];

/// A surface: its vertices, and its triangles as every three indices one.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The points.
    pub vertices: Vec<Vertex>,
    /// Indices of points, three for each triangle, counter-clockwise as seen from outside.
    pub indices: Vec<u32>,
}

/// The surface of a scene without heights, for an image of `image` (width over height).
pub fn surface(scene: Scene, image: f32) -> Mesh {
    match scene {
        Scene::Image | Scene::Plane | Scene::Terrain => {
            grid([1, 1], |uv| Vec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0))
        }
        Scene::Globe => grid(GLOBE_QUADS, |uv| {
            let (longitude, latitude) =
                ((uv.x - 0.5) * std::f32::consts::TAU, (0.5 - uv.y) * std::f32::consts::PI);
            direction(longitude, latitude)
        }),
    }
}

pub(crate) fn grid(quads: [u32; 2], position_from_uv: impl Fn(Vec2) -> Vec3) -> Mesh {
    let [columns, rows] = quads;
    let mut mesh = Mesh { vertices: Vec::new(), indices: Vec::new() };
    for y in 0..=rows {
        for x in 0..=columns {
            let uv = Vec2::new(x as f32 / columns as f32, y as f32 / rows as f32);
            mesh.vertices.push(Vertex { position: position_from_uv(uv), uv });
        }
    }
    for y in 0..rows {
        for x in 0..columns {
            let a = y * (columns + 1) + x;
            let (b, c, d) = (a + columns + 1, a + 1, a + columns + 2);
            mesh.indices.extend([a, b, c, c, b, d]);
        }
    }
    mesh
}

/// The point of the unit sphere at a longitude and latitude.
pub(crate) fn direction(longitude: f32, latitude: f32) -> Vec3 {
    Vec3::new(longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin())
}
