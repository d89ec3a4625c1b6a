//! The surfaces that scenes without heights put a texture on, as triangles.

use glam::{Vec2, Vec3};

use crate::scene::{Scene, direction};

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
        Scene::Globe | Scene::Planet => grid(GLOBE_QUADS, |uv| {
            let (longitude, latitude) =
                ((uv.x - 0.5) * std::f32::consts::TAU, (0.5 - uv.y) * std::f32::consts::PI);
            direction(longitude, latitude)
        }),
    }
}

pub(super) fn grid(quads: [u32; 2], position_from_uv: impl Fn(Vec2) -> Vec3) -> Mesh {
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
