//! The camera paths: deterministic, so that a picture can be had again.
//!
//! Each is a pure function of the frame index, lasts [`Path::frames`] and then holds its last pose. `spin`
//! and `teleport` come back to earlier views.

use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

use super::pose::Pose;
use crate::scene::Scene;

/// How a camera moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Path {
    /// Not at all.
    Still,
    /// Along the surface, low over it.
    Fly,
    /// Round in a circle, so that every view comes back.
    Spin,
    /// From all of the texture down to its texels.
    Zoom,
    /// To another place every 30 frames, five places in turn.
    Teleport,
}

/// Frames of a path that moves.
const FRAMES: u64 = 300;
/// Frames between two teleports.
const STAY: u64 = 30;
/// Where `teleport` goes, in uv; the Earth's image has land there.
const PLACES: [Vec2; 5] = [
    Vec2::new(0.53, 0.24),
    Vec2::new(0.23, 0.28),
    Vec2::new(0.72, 0.34),
    Vec2::new(0.34, 0.60),
    Vec2::new(0.87, 0.64),
];

impl Path {
    /// Every path.
    pub const ALL: [Path; 5] = [Path::Still, Path::Fly, Path::Spin, Path::Zoom, Path::Teleport];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Path::Still => "still",
            Path::Fly => "fly",
            Path::Spin => "spin",
            Path::Zoom => "zoom",
            Path::Teleport => "teleport",
        }
    }

    /// Frames that the path lasts.
    pub fn frames(self) -> u64 {
        if self == Path::Still { 1 } else { FRAMES }
    }

    /// The pose in a frame, counted from 0, over an image of `image` (width over height).
    pub fn pose(self, scene: Scene, image: f64, frame: u64) -> Pose {
        // Recorded paths are in f32, and are what they have always been.
        let image = image as f32;
        let frame = frame.min(self.frames() - 1);
        let t = frame as f32 / (FRAMES - 1) as f32;
        match self {
            Path::Still => Pose::first(scene),
            Path::Fly => {
                low_over(scene, image, Vec2::new(0.15 + 0.7 * t, 0.25 + 0.1 * (2.0 * TAU * t).sin()))
            }
            Path::Spin => {
                // One and a half turns, so that every view of the last half was seen before.
                let (sin, cos) = (1.5 * TAU * t).sin_cos();
                low_over(scene, image, Vec2::new(0.5 + 0.25 * cos, 0.5 + 0.2 * sin))
            }
            Path::Zoom => zoom(scene, image, t),
            Path::Teleport => low_over(scene, image, PLACES[(frame / STAY) as usize % PLACES.len()]),
        }
    }
}

/// A view of the surroundings of a point, given in uv, from low above it.
fn low_over(scene: Scene, image: f32, uv: Vec2) -> Pose {
    match scene {
        Scene::Image => Pose::image(uv.as_dvec2(), 10.0),
        Scene::Plane => {
            let ground = Vec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0);
            standing(ground + Vec3::new(0.0, -0.12, 0.1), 0.65)
        }
        Scene::Terrain => {
            let ground = Vec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0);
            standing(ground + Vec3::new(0.0, -0.12, 0.05), 0.3)
        }
        Scene::Globe | Scene::Planet => over(uv, 0.25),
    }
}

/// Down from afar to a few texels, at an even pace in levels.
fn zoom(scene: Scene, image: f32, t: f32) -> Pose {
    let place = PLACES[0];
    match scene {
        Scene::Image => {
            let centre = Vec2::splat(0.5).lerp(place, t.min(0.25) * 4.0);
            Pose::image(centre.as_dvec2(), 80f32.powf(t).into())
        }
        Scene::Plane | Scene::Terrain => {
            let height = 1.2 * 0.02f32.powf(t);
            let ground = Vec3::new(2.0 * place.x - 1.0, (1.0 - 2.0 * place.y) / image, 0.0);
            standing(ground + Vec3::new(0.0, -height, height), std::f32::consts::FRAC_PI_4)
        }
        Scene::Globe | Scene::Planet => over(place, 3.0 * 0.05f32.powf(t)),
    }
}

fn over(uv: Vec2, altitude: f32) -> Pose {
    let (longitude, latitude) = ((uv.x - 0.5) * TAU, (0.5 - uv.y) * TAU / 2.0);
    Pose::globe(longitude.into(), latitude.into(), altitude.into())
}

fn standing(eye: Vec3, pitch: f32) -> Pose {
    Pose::Plane { eye: eye.as_dvec3(), yaw: 0.0, pitch: pitch.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_holds_its_last_pose_and_is_finite() {
        for (scene, path) in Scene::ALL.into_iter().flat_map(|s| Path::ALL.map(|p| (s, p))) {
            let last = path.pose(scene, 2.0, path.frames() - 1);
            assert_eq!(path.pose(scene, 2.0, 10_000), last);
            for frame in 0..path.frames() {
                let matrix = path.pose(scene, 2.0, frame).clip_from_world(16.0 / 9.0, 2.0);
                assert!(matrix.is_finite(), "{scene:?} {path:?} {frame}");
            }
        }
    }

    #[test]
    fn spin_and_teleport_come_back() {
        for scene in Scene::ALL {
            assert_eq!(Path::Teleport.pose(scene, 2.0, 0), Path::Teleport.pose(scene, 2.0, 150));
            let view = |frame| Path::Spin.pose(scene, 2.0, frame).clip_from_world(1.6, 2.0);
            assert!(view(20).abs_diff_eq(view(219), 0.05), "{scene:?}: frame 219 is near frame 20");
        }
    }
}
