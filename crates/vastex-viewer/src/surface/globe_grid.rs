//! A grid over a whole globe that is dense below the camera, for places between orbit and the ground.
//!
//! Its lines are meridians and parallels, the nearer to the camera the closer together, so it is one mesh
//! without seams, and in a plate carrée texture every quad is a rectangle. Everything is worked out in f64
//! and told from the camera, in altitudes, and from the texel below it: what is near has small numbers, which
//! f32 holds exactly enough.

use std::f64::consts::{PI, TAU};

use glam::camera::rh::proj::directx as projection;
use glam::{DMat3, DVec2, DVec3, Mat4, Vec2};

use super::mesh::{Mesh, Vertex};
use crate::camera::METRE;

/// Quads from the camera to the other side, and from it to either pole.
const QUADS: u32 = 96;
/// The first of them, in altitudes.
const FIRST: f64 = 0.05;
/// Vertical field of view: 60 degrees.
const FIELD_OF_VIEW: f32 = std::f32::consts::FRAC_PI_3;

/// A camera over the unit sphere, north in front of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobePose {
    /// Longitude below it, in radians; 0 is in the middle of the image.
    pub longitude: f64,
    /// Latitude below it, in radians, north positive, less than a quarter turn.
    pub latitude: f64,
    /// Height above the ground, in radii.
    pub altitude: f64,
    /// Turn upwards from looking straight down, in radians.
    pub pitch: f64,
}

impl GlobePose {
    /// Radii of the Earth in a metre.
    pub const METRE: f64 = METRE;

    /// East, north and up, below the camera.
    pub fn directions(&self) -> DMat3 {
        let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (self.longitude.sin_cos(), self.latitude.sin_cos());
        DMat3::from_cols(
            DVec3::new(-sin_lon, cos_lon, 0.0),
            DVec3::new(-cos_lon * sin_lat, -sin_lon * sin_lat, cos_lat),
            DVec3::new(cos_lon * cos_lat, sin_lon * cos_lat, sin_lat),
        )
    }

    /// The camera's right, up and backward, in east, north and up.
    pub fn camera(&self) -> DMat3 {
        let (sin, cos) = self.pitch.sin_cos();
        DMat3::from_cols(DVec3::X, DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos))
    }

    /// Where the camera is above, in texels of a texture of `size` over the whole globe.
    pub fn texel(&self, size: [u32; 2]) -> DVec2 {
        let [width, height] = size.map(f64::from);
        DVec2::new((self.longitude / TAU + 0.5).rem_euclid(1.0) * width, (0.5 - self.latitude / PI) * height)
    }
}

/// A globe as one camera sees it.
#[derive(Clone, Debug)]
pub struct GlobeGrid {
    /// Positions from the camera, in altitudes, along east, north and up; in the place of uv texels of level
    /// 0 from `anchor`.
    pub mesh: Mesh,
    /// The texel below the camera.
    pub anchor: [u32; 2],
    /// Clip space from these positions.
    pub clip_from_camera: Mat4,
}

impl GlobeGrid {
    /// For a texture of `size` texels, seen in a picture of `view` (width over height). Costs some 37,000
    /// vertices.
    pub fn new(pose: &GlobePose, size: [u32; 2], view: f32) -> GlobeGrid {
        let below = pose.texel(size);
        let anchor = below.floor();
        let [texels_x, texels_y] = [f64::from(size[0]) / TAU, f64::from(size[1]) / PI];
        let cos = pose.latitude.cos();
        let longitudes = both(steps(pose.altitude / cos, PI), steps(pose.altitude / cos, PI));
        let to_pole = |sign: f64| PI / 2.0 - sign * pose.latitude;
        let latitudes = both(steps(pose.altitude, to_pole(-1.0)), steps(pose.altitude, to_pole(1.0)));
        let mut vertices = Vec::with_capacity(longitudes.len() * latitudes.len());
        for &north in &latitudes {
            for &east in &longitudes {
                let position = from_camera(pose, east, north).as_vec3();
                let offset = below - anchor + DVec2::new(east * texels_x, -north * texels_y);
                vertices.push(Vertex { position, uv: Vec2::new(offset.x as f32, offset.y as f32) });
            }
        }
        let far = ((pose.altitude + 2.0) / pose.altitude) as f32;
        let view_from_camera = Mat4::from_mat3(pose.camera().transpose().as_mat3());
        let clip_from_view = projection::perspective(FIELD_OF_VIEW, view, 0.5, far);
        let last = [size[0] - 1, size[1] - 1];
        GlobeGrid {
            mesh: Mesh { vertices, indices: indices(longitudes.len() as u32, latitudes.len() as u32) },
            anchor: [(anchor.x as u32).min(last[0]), (anchor.y as u32).min(last[1])],
            clip_from_camera: clip_from_view * view_from_camera,
        }
    }

    /// Indices of every grid.
    pub fn index_count() -> u32 {
        4 * QUADS * QUADS * 6
    }
}

/// The point so far east and north of where the camera is above, from the camera, in altitudes along east,
/// north and up. By way of half angles, so that of small ones nothing is lost.
fn from_camera(pose: &GlobePose, east: f64, north: f64) -> DVec3 {
    let (sin_lat, cos_lat) = pose.latitude.sin_cos();
    let (sin_north, cos_there) = (north.sin(), (pose.latitude + north).cos());
    // 1 - cos, twice the square of the sine of the half.
    let (versed_east, versed_north) = (2.0 * (east / 2.0).sin().powi(2), 2.0 * (north / 2.0).sin().powi(2));
    DVec3::new(
        cos_there * east.sin(),
        sin_north + sin_lat * cos_there * versed_east,
        -versed_north - cos_lat * cos_there * versed_east - pose.altitude,
    ) / pose.altitude
}

/// From 0 to `end`, the first step in proportion to the altitude, each longer than the last.
fn steps(altitude: f64, end: f64) -> Vec<f64> {
    let first = FIRST * altitude;
    let growth = (end / first).ln_1p() / f64::from(QUADS);
    let step = |n: u32| if n == QUADS { end } else { first * (growth * f64::from(n)).exp_m1() };
    (0..=QUADS).map(step).collect()
}

/// One way and the other from where both begin.
fn both(before: Vec<f64>, after: Vec<f64>) -> Vec<f64> {
    before.into_iter().skip(1).rev().map(|step| -step).chain(after).collect()
}

fn indices(columns: u32, rows: u32) -> Vec<u32> {
    let quad = |x: u32, y: u32| {
        let south_west = y * columns + x;
        let north_west = south_west + columns;
        [north_west, south_west, north_west + 1, north_west + 1, south_west, south_west + 1]
    };
    (0..rows - 1).flat_map(|y| (0..columns - 1).flat_map(move |x| quad(x, y))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [1 << 31, 1 << 30];

    fn pose(altitude: f64) -> GlobePose {
        GlobePose { longitude: 0.3, latitude: -0.7, altitude, pitch: 0.4 }
    }

    #[test]
    fn every_vertex_is_on_the_sphere_where_its_texel_says() {
        for altitude in [2.0, 0.1, 1e-3, 1e-7] {
            let pose = pose(altitude);
            let grid = GlobeGrid::new(&pose, SIZE, 1.5);
            assert_eq!(grid.mesh.indices.len() as u32, GlobeGrid::index_count());
            for Vertex { position, uv } in grid.mesh.vertices.iter().step_by(7) {
                let local = position.as_dvec3() * altitude + DVec3::new(0.0, 0.0, 1.0 + altitude);
                let world = pose.directions() * local;
                assert!((world.length() - 1.0).abs() < 1e-6, "{world}");
                let texel = [0, 1].map(|a| f64::from(grid.anchor[a]) + f64::from(uv[a]));
                let (longitude, latitude) =
                    ((texel[0] / f64::from(SIZE[0]) - 0.5) * TAU, (0.5 - texel[1] / f64::from(SIZE[1])) * PI);
                let expected = DVec3::new(
                    longitude.cos() * latitude.cos(),
                    longitude.sin() * latitude.cos(),
                    latitude.sin(),
                );
                assert!(world.distance(expected) < 1e-6, "{world} and {expected} from {altitude}");
            }
        }
    }

    /// What is below the camera moves by as much as the camera does, to the hundredth of a millimetre, at the
    /// other side it closes.
    #[test]
    fn near_vertices_are_exact_and_the_far_side_closes() {
        let pose = pose(1.5 * GlobePose::METRE);
        let grid = GlobeGrid::new(&pose, SIZE, 1.5);
        let side = 2 * QUADS as usize + 1;
        let middle = grid.mesh.vertices[side * QUADS as usize + QUADS as usize];
        assert!((middle.position - glam::Vec3::new(0.0, 0.0, -1.0)).length() < 1e-6);
        assert!(middle.uv.cmpge(Vec2::ZERO).all() && middle.uv.cmplt(Vec2::ONE).all(), "{}", middle.uv);
        for row in grid.mesh.vertices.chunks_exact(side) {
            let (first, last) = (row[0].position, row[side - 1].position);
            assert!((first - last).length() <= 1e-6 * first.length(), "{first} and {last}");
        }
    }
}
