//! Moves over ground whose heights are a formula, so that where a ray meets it can be said exactly.

use super::*;
use crate::camera::{Aspects, Controller, Move};

const ASPECTS: Aspects = [1.6, 2.0];
/// A thousandth of a pixel of 1000.
const NEAR: f64 = 1e-6;

/// Waves of hills over the uv of a surface, so high at most.
struct Hills {
    most: f64,
}

impl Hills {
    fn height(&self, uv: DVec2) -> f64 {
        self.most * (0.5 + 0.5 * (uv.x * 90.0).sin() * (uv.y * 70.0).cos())
    }

    /// Where a ray from a camera, told from the surface without heights, meets them.
    fn met(&self, camera: &Pose, point: DVec2) -> Option<f64> {
        let (ray, ground) = (camera.ray(point)?, camera.ground(2.0)?);
        let above = |at: f64| ground.height(ray.at(at)) - self.height(ground.uv(ray.at(at)));
        let [begin, end] = ground.beneath(&ray, self.most)?;
        const STEPS: u32 = 20_000;
        let place = |step: u32| begin + (end - begin) * f64::from(step) / f64::from(STEPS);
        let step = (1..=STEPS).find(|step| above(place(*step)) <= 0.0)?;
        let (mut low, mut high) = (place(step - 1), place(step));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if above(middle) > 0.0 { &mut low } else { &mut high }) = middle;
        }
        Some(0.5 * (low + high))
    }
}

impl GroundHeights for Hills {
    fn below(&mut self, pose: &Pose) -> f64 {
        self.height(pose.ground(2.0).unwrap().uv(DVec3::ZERO))
    }

    fn distance(&mut self, pose: &Pose, point: DVec2) -> Option<f64> {
        let camera = pose.risen(self.below(pose));
        self.met(&camera, point)
    }
}

/// Where a camera over hills sees a point of the world, in view heights from the middle.
fn seen_at(pose: Pose, hills: &mut Hills, place: DVec3) -> DVec2 {
    let camera = pose.risen(hills.below(&pose));
    let (local, axes) = match camera {
        Pose::Plane { eye, yaw, pitch } => (place - eye, axes_of_plane(yaw, pitch)),
        Pose::Globe { longitude, latitude, altitude, aim } => {
            let from_middle = world_from_local(longitude, latitude).transpose() * place;
            (from_middle - DVec3::Z * (1.0 + altitude), aim.local_from_view())
        }
        Pose::Image { .. } => unreachable!(),
    };
    let seen = axes.transpose() * local;
    let tangent = 2.0 * (crate::camera::FIELD_OF_VIEW / 2.0).tan();
    DVec2::new(seen.x, -seen.y) / (seen.z * tangent)
}

/// Cameras over hills: high above them, among them, and looking along the ground.
fn cameras() -> [Pose; 5] {
    [
        Pose::Plane { eye: DVec3::new(0.1, -0.35, 0.2), yaw: 0.3, pitch: 0.6 },
        Pose::Plane { eye: DVec3::new(0.1, -0.2, 0.012), yaw: -0.3, pitch: 0.25 },
        Pose::globe(0.3, 0.6, 0.5),
        Pose::globe(0.3, 0.6, 0.05).with_aim(Aim::new(1.0, 1.0)),
        Pose::globe(-2.0, -0.4, 0.01).with_aim(Aim::new(4.0, 1.1)),
    ]
}

#[test]
fn the_mountain_under_the_pointer_stays_there() {
    let mut hills = Hills { most: 0.02 };
    let mut held_high = 0;
    for pose in cameras() {
        let (from, to) = (DVec2::new(0.12, 0.2), DVec2::new(0.02, 0.28));
        let held = Held::new(pose, from, &mut hills).unwrap();
        held_high += usize::from(held.height > 0.25 * hills.most);
        let seen = seen_at(pose, &mut hills, held.place);
        assert!(seen.distance(from) < NEAR, "{pose:?}: {seen}");
        let mut camera = Controller::new(pose);
        for step in 0..20 {
            let at = |step: i32| from.lerp(to, f64::from(step) / 20.0);
            camera.apply_over(Move::Grab(at(step), at(step + 1)), ASPECTS, Some(&mut hills));
        }
        let seen = seen_at(camera.pose(), &mut hills, held.place);
        assert!(seen.distance(to) < NEAR, "dragged: {pose:?}: {seen}");
        let height = camera.pose().height() + hills.below(&camera.pose());
        assert!((height - held.camera.height()).abs() < 1e-9, "a drag goes straight on");
        let before = hills.distance(&camera.pose(), to).unwrap();
        (0..6).for_each(|_| camera.apply_over(Move::ZoomTo(1.25, to), ASPECTS, Some(&mut hills)));
        let seen = seen_at(camera.pose(), &mut hills, held.place);
        assert!(seen.distance(to) < NEAR, "zoomed in: {:?}: {seen}", camera.pose());
        let nearer = before / hills.distance(&camera.pose(), to).unwrap();
        // It comes nearer along a straight line, while a globe curves away under it.
        assert!((nearer / 1.25f64.powi(6) - 1.0).abs() < 0.06, "{nearer} times as near");
        (0..6).for_each(|_| camera.apply_over(Move::ZoomTo(0.8, to), ASPECTS, Some(&mut hills)));
        let seen = seen_at(camera.pose(), &mut hills, held.place);
        assert!(seen.distance(to) < NEAR, "and out: {:?}: {seen}", camera.pose());
        // As if the ground were level it would go.
        let mut level = Controller::new(pose);
        level.apply(Move::ZoomTo(3.0, from), ASPECTS);
        let seen = seen_at(level.pose(), &mut hills, held.place);
        assert!(seen.distance(from) > 20.0 * NEAR, "{pose:?}: {seen}");
    }
    assert!(held_high >= 2, "mountains are held, {held_high}");
}

#[test]
fn a_camera_goes_round_the_mountain_in_the_middle() {
    let mut hills = Hills { most: 0.02 };
    for pose in cameras() {
        let held = Held::new(pose, DVec2::ZERO, &mut hills).unwrap();
        let mut camera = Controller::new(pose);
        for angles in [DVec2::new(0.4, 0.0), DVec2::new(0.0, -0.1), DVec2::new(-0.2, -0.05)] {
            camera.apply_over(Move::Orbit(angles), ASPECTS, Some(&mut hills));
            let seen = seen_at(camera.pose(), &mut hills, held.place);
            assert!(seen.length() < NEAR, "{pose:?} to {:?}: {seen}", camera.pose());
        }
        assert_ne!(camera.pose(), pose);
        camera.apply_over(Move::Upright, ASPECTS, Some(&mut hills));
        let seen = seen_at(camera.pose(), &mut hills, held.place);
        assert!(seen.length() < NEAR, "upright: {seen}");
        // However far it is tilted and turned, it stays above the ground.
        for _ in 0..60 {
            camera.apply_over(Move::Orbit(DVec2::new(0.1, 0.05)), ASPECTS, Some(&mut hills));
            let [least, _] = camera.pose().heights_allowed();
            assert!(camera.pose().height() >= least, "{:?}", camera.pose());
        }
    }
}

#[test]
fn a_camera_that_comes_to_the_ground_stays_above_it() {
    let mut hills = Hills { most: 0.02 };
    for pose in cameras() {
        let mut camera = Controller::new(pose);
        for _ in 0..200 {
            camera.apply_over(Move::ZoomTo(1.25, DVec2::new(0.1, 0.1)), ASPECTS, Some(&mut hills));
            let [least, _] = camera.pose().heights_allowed();
            assert!(camera.pose().height() >= least, "{:?}", camera.pose());
        }
        // And away again, until no ground's height matters.
        (0..400).for_each(|_| camera.apply_over(Move::ZoomTo(0.8, DVec2::ZERO), ASPECTS, Some(&mut hills)));
        assert!(camera.pose().height() > 5.0, "{:?}", camera.pose());
    }
}

/// Over level ground moves are those that there are without heights; but a camera comes nearer to a point
/// along a straight line, and without heights by its height above a globe.
#[test]
fn over_level_ground_moves_are_what_they_are_without_heights() {
    for pose in cameras() {
        let mut level = Hills { most: 0.0 };
        for (moved, exactly) in [
            (Move::ZoomTo(1.5, DVec2::new(0.1, 0.2)), 0.02),
            (Move::Grab(DVec2::new(0.1, 0.2), DVec2::new(0.05, 0.25)), 1e-6),
            (Move::Orbit(DVec2::new(0.2, -0.1)), 1e-6),
        ] {
            let (mut over, mut plain) = (Controller::new(pose), Controller::new(pose));
            over.apply_over(moved, ASPECTS, Some(&mut level));
            plain.apply(moved, ASPECTS);
            let height = plain.pose().height();
            let apart = over.pose().over().distance(plain.pose().over()) / height;
            let higher = over.pose().height() / height - 1.0;
            assert!(apart < exactly && higher.abs() < exactly, "{moved:?} of {pose:?}: {apart} {higher}");
        }
    }
}
