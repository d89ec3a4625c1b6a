//! Where a camera is expected to be that goes on as it does.
//!
//! What follows from it, and how far ahead it is worth looking, the textures know.

use glam::{DVec2, DVec3};
use vastex::prefetch::Motion;

use super::pose::Pose;

/// By what the height or the zoom is expected to change at most.
const MOST_CHANGE: f64 = 16.0;

/// Where the camera was in the last two frames, the newest last.
#[derive(Debug, Default)]
pub struct Ahead {
    last: [Option<Pose>; 2],
}

impl Ahead {
    /// The camera is at `pose` now: where it will be in so many frames; `None` before it was seen to move.
    pub fn expect(&mut self, pose: Pose, frames: u64) -> Option<Pose> {
        let [before, newest] = self.last;
        self.last = [newest, Some(pose)];
        Some(pose.expected(&[before?, newest?], frames as f64))
    }
}

impl Pose {
    /// The pose in so many frames of a camera that had the poses `before` in the two last frames, the older
    /// one first, and goes on at the same speed, turning and approaching as it did.
    pub fn expected(self, before: &[Pose; 2], frames: f64) -> Pose {
        let [Some(first), Some(second), Some(now)] = [before[0], before[1], self].map(place) else {
            return self;
        };
        let motion = Motion::through([first, second, now].map(|place: DVec3| place.to_array()));
        let at = DVec3::from_array(motion.position_after(frames));
        let scaled = |now: f64, before: f64| {
            let change = (now / before).powf(frames);
            now * change.clamp(1.0 / MOST_CHANGE, MOST_CHANGE)
        };
        let on = |now: f64, before: f64| now + (now - before) * frames;
        match (self, before[1]) {
            (Pose::Image { zoom, orientation, .. }, Pose::Image { zoom: was, .. }) => {
                Pose::Image { centre: DVec2::new(at.x, at.y), zoom: scaled(zoom, was), orientation }
            }
            (Pose::Plane { yaw, pitch, .. }, Pose::Plane { yaw: yaw_was, pitch: pitch_was, .. }) => {
                Pose::Plane { eye: at, yaw: on(yaw, yaw_was), pitch: on(pitch, pitch_was) }
            }
            (Pose::Globe { altitude, aim, .. }, Pose::Globe { altitude: was, .. }) => {
                Pose::globe(at.x, at.y, scaled(altitude, was)).with_aim(aim)
            }
            // Another scene is no motion.
            _ => self,
        }
    }
}

/// What of a pose moves along a way.
fn place(pose: Pose) -> Option<DVec3> {
    let place = match pose {
        Pose::Image { centre, .. } => centre.extend(0.0),
        Pose::Plane { eye, .. } => eye,
        Pose::Globe { longitude, latitude, .. } => DVec3::new(longitude, latitude, 0.0),
    };
    place.is_finite().then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Path;
    use crate::scene::Scene;

    #[test]
    fn paths_go_on_as_expected() {
        for (scene, path) in
            Scene::ALL.into_iter().flat_map(|s| [Path::Fly, Path::Spin, Path::Zoom].map(|p| (s, p)))
        {
            let pose = |frame: u64| path.pose(scene, 2.0, frame);
            for frame in [2, 40, 150, 280] {
                let expected = pose(frame).expected(&[pose(frame - 2), pose(frame - 1)], 8.0);
                let matrix = |pose: Pose| pose.clip_from_world(1.6, 2.0);
                let there = matrix(pose(frame + 8));
                let error = |matrix: glam::Mat4| {
                    (0..4).map(|column| (matrix.col(column) - there.col(column)).length()).sum::<f32>()
                };
                let (expected, now) = (error(matrix(expected)), error(matrix(pose(frame))));
                assert!(expected <= now * 0.25 + 1e-3, "{scene:?} {path:?} {frame}: {expected} of {now}");
            }
        }
    }
}
