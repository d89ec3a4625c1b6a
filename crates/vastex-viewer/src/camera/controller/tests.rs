//! What moves make of cameras.

use glam::DVec3;

use super::*;
use crate::camera::Aim;

const ASPECTS: Aspects = [1.6, 2.0];

#[test]
fn zooming_keeps_what_lies_below_the_pointer() {
    let point = DVec2::new(0.3, -0.2);
    let pose = Pose::image(DVec2::splat(0.5), 2.0);
    // A drag by -point brings what lies below the pointer to the middle.
    let below = |pose: Pose| pose.dragged(-point, ASPECTS[0], ASPECTS[1]).over();
    let mut camera = Controller::new(pose);
    camera.apply(Move::ZoomTo(1.25, point), ASPECTS);
    assert!(below(pose).distance(below(camera.pose())) < 1e-12);
    assert_ne!(pose, camera.pose());
}

#[test]
fn whole_magnifications_put_texels_on_pixels_where_the_pointer_is() {
    let (view, image) = ([1281, 720], [10800, 5401]);
    for magnification in [1.0, 2.0, 7.0, 0.5, 1.0 / 3.0] {
        let point = DVec2::new(0.31, -0.17);
        let mut camera = Controller::new(Pose::image(DVec2::new(0.412_34, 0.6), 3.3));
        let aspects = [1281.0 / 720.0, 10800.0 / 5401.0];
        let below = |pose: Pose| pose.dragged(-point, aspects[0], aspects[1]).over();
        let before = below(camera.pose());
        camera.magnify(magnification, point, view, image);
        let shown = camera.pose().magnification(view, image).unwrap();
        assert!((shown - magnification).abs() < 1e-12, "{shown}");
        let moved = (below(camera.pose()) - before) * DVec2::new(10800.0, 5401.0) * magnification;
        assert!(moved.abs().max_element() <= 1.0, "{moved} pixels from where it was");
        let Pose::Image { centre, .. } = camera.pose() else { unreachable!() };
        // The left and upper edge of the view, in pixels from the image's corner.
        let edge = centre * DVec2::new(10800.0, 5401.0) * magnification - DVec2::new(1281.0, 720.0) / 2.0;
        assert!((edge - edge.round()).abs().max_element() < 1e-6, "{edge} at {magnification}");
    }
    // A camera over an edge, and an image that is far smaller than the view.
    for (image, centre) in
        [([10800, 5401], DVec2::ZERO), ([10800, 5401], DVec2::ONE), ([32, 32], DVec2::splat(0.5))]
    {
        for magnification in [1.0, 0.5] {
            let mut camera = Controller::new(Pose::image(centre, 1.0));
            camera.magnify(magnification, DVec2::ZERO, view, image);
            assert_eq!(
                camera.pose().magnification(view, image).map(|at| (at * 1e9).round()),
                Some(magnification * 1e9)
            );
            let Pose::Image { centre, .. } = camera.pose() else { unreachable!() };
            let size = DVec2::new(image[0].into(), image[1].into());
            let edge = centre * size * magnification - DVec2::new(1281.0, 720.0) / 2.0;
            assert!((edge - edge.round()).abs().max_element() < 1e-6, "{edge} of {image:?}");
            assert!(centre.min_element() >= 0.0 && centre.max_element() <= 1.0);
        }
    }
    let globe = Pose::first(crate::scene::Scene::Globe);
    let mut camera = Controller::new(globe);
    camera.magnify(1.0, DVec2::ZERO, view, image);
    assert_eq!(camera.pose(), globe);
}

#[test]
fn what_is_turned_is_dragged_zoomed_and_aligned_as_it_is_seen() {
    let (view, image) = ([1281, 720], [10800, 5401]);
    let aspects = [1281.0 / 720.0, 10800.0 / 5401.0];
    let texel =
        |camera: &Controller, pixel: DVec2| camera.pose().placement(view, image).unwrap().texel(pixel);
    for moves in [[Move::Turn(90.0), Move::Turn(0.0)], [Move::Turn(-20.0), Move::Flip { is_vertical: true }]]
    {
        let mut camera = Controller::new(Pose::image(DVec2::new(0.4, 0.6), 30.0));
        moves.into_iter().for_each(|turn| camera.apply(turn, aspects));
        let from = DVec2::new(300.0, 500.0);
        let below = texel(&camera, from);
        // Dragged by a tenth of the view's height to the right, and a fifth down.
        camera.apply(Move::Drag(DVec2::new(0.1, 0.2)), aspects);
        assert!((texel(&camera, from + DVec2::new(72.0, 144.0)) - below).length() < 1e-6);
        let (point, pixel) = (DVec2::new(0.25, -0.25), DVec2::new(640.5 + 180.0, 360.0 - 180.0));
        let below = texel(&camera, pixel);
        camera.apply(Move::ZoomTo(3.0, point), aspects);
        assert!((texel(&camera, pixel) - below).length() < 1e-6);
        let Pose::Image { zoom, .. } = camera.pose() else { panic!("a pose of an image") };
        let pixels_a_texel = camera.pose().magnification(view, image).unwrap();
        // A step to the right is one along the rows of the picture, however the image is turned.
        let (middle, step) =
            (DVec2::new(640.5, 360.0), DVec2::new(0.1 / zoom * 10800.0 * pixels_a_texel, 0.0));
        let below = texel(&camera, middle + step);
        camera.apply(Move::Walk(DVec2::new(0.1, 0.0), 1.0), aspects);
        assert!((texel(&camera, middle) - below).length() < 1e-6);
        camera.magnify(2.0, point, view, image);
        let corner = texel(&camera, DVec2::ZERO) * 2.0;
        let is_on_pixels = (corner - corner.round()).abs().max_element() < 1e-6;
        assert_eq!(is_on_pixels, camera.pose().orientation().is_axis_aligned(), "{corner}");
    }
    let mut globe = Controller::new(Pose::first(crate::scene::Scene::Globe));
    globe.apply(Move::Turn(90.0), aspects);
    assert_eq!(globe.pose(), Pose::first(crate::scene::Scene::Globe));
}

/// Where a point of the ground is seen, in view heights from the middle.
fn seen_at(pose: Pose, place: DVec3) -> DVec2 {
    let (axes, eye) = match pose {
        Pose::Plane { eye, yaw, pitch } => {
            let ahead = DVec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
            let right = ahead.cross(DVec3::Z).normalize();
            ([right, right.cross(ahead), ahead], eye)
        }
        pose => (pose.axes(), pose.eye()),
    };
    let [right, up, ahead] = axes.map(|axis| axis.dot(place - eye));
    DVec2::new(right, -up) / ahead / (2.0 * (crate::camera::FIELD_OF_VIEW / 2.0).tan())
}

/// Cameras over a globe and a plane, straight down and aslant, far and near.
fn over_ground() -> Vec<Pose> {
    let globe = |altitude, aim| Pose::globe(2.9, 0.7, altitude).with_aim(aim);
    vec![
        Pose::first(crate::scene::Scene::Globe),
        Pose::first(crate::scene::Scene::Terrain),
        Pose::first(crate::scene::Scene::Plane),
        globe(0.2, Aim::new(0.5, 0.6)),
        globe(1e-3, Aim::new(4.0, 1.1)),
        globe(1e-7, Aim::DOWN),
        globe(1e-7, Aim::new(2.0, 0.8)),
        Pose::Plane { eye: DVec3::new(0.2, -0.3, 0.01), yaw: 2.0, pitch: 0.5 },
    ]
}

#[test]
fn what_is_below_the_pointer_stays_there_over_any_ground() {
    // A thousandth of a pixel of 2000.
    let near = 5e-7;
    for pose in over_ground() {
        let (from, to) = (DVec2::new(0.1, 0.2), DVec2::new(-0.15, 0.3));
        let place = pose.ground_at(from).unwrap().place;
        assert!(seen_at(pose, place).distance(from) < near, "{pose:?} sees it at {}", seen_at(pose, place));
        let mut camera = Controller::new(pose);
        // In many steps, as a pointer moves.
        (0..50).for_each(|step| {
            let at = |step: i32| from.lerp(to, f64::from(step) / 50.0);
            camera.apply(Move::Grab(at(step), at(step + 1)), ASPECTS);
        });
        assert!(seen_at(camera.pose(), place).distance(to) < near, "dragged: {pose:?}");
        (0..8).for_each(|_| camera.apply(Move::ZoomTo(1.25, to), ASPECTS));
        assert!(seen_at(camera.pose(), place).distance(to) < near, "zoomed in: {:?}", camera.pose());
        (0..8).for_each(|_| camera.apply(Move::ZoomTo(0.8, to), ASPECTS));
        assert!(seen_at(camera.pose(), place).distance(to) < near, "and out: {:?}", camera.pose());
        camera.apply(Move::Pinch(to - from, 2.0, to), ASPECTS);
        assert_ne!(camera.pose(), pose);
    }
}

#[test]
fn the_middle_stays_where_it_is_while_the_camera_goes_round_it() {
    for pose in over_ground() {
        let middle = pose.ground_at(DVec2::ZERO).unwrap();
        let mut camera = Controller::new(pose);
        for angles in [DVec2::new(0.7, 0.0), DVec2::new(0.0, 0.2), DVec2::new(-0.3, -0.1)] {
            camera.apply(Move::Orbit(angles), ASPECTS);
            let now = camera.pose().ground_at(DVec2::ZERO).unwrap();
            let moved = now.place.distance(middle.place) / middle.distance;
            assert!(moved < 1e-6, "{pose:?} to {:?}: {moved}", camera.pose());
            assert!((now.distance / middle.distance - 1.0).abs() < 1e-6, "{:?}", camera.pose());
        }
        assert_ne!(camera.pose(), pose);
        camera.apply(Move::Upright, ASPECTS);
        match camera.pose() {
            Pose::Globe { aim, .. } => assert_eq!(aim, Aim::DOWN),
            Pose::Plane { yaw, .. } => assert!(yaw.abs() < 1e-12),
            Pose::Image { .. } => unreachable!(),
        }
        // However far it is tilted, it stays above the ground and sees it.
        (0..100).for_each(|_| camera.apply(Move::Orbit(DVec2::new(0.1, 0.05)), ASPECTS));
        assert!(camera.pose().ground_at(DVec2::ZERO).is_some(), "{:?}", camera.pose());
    }
}

#[test]
fn where_no_ground_is_the_view_is_dragged_and_zoomed_by_its_middle() {
    let mut camera = Controller::new(Pose::globe(0.0, 0.0, 5.0));
    camera.apply(Move::Grab(DVec2::new(0.45, 0.0), DVec2::new(0.4, 0.0)), ASPECTS);
    let Pose::Globe { longitude, .. } = camera.pose() else { unreachable!() };
    assert!(longitude > 0.0);
    camera.apply(Move::ZoomTo(2.0, DVec2::new(0.45, 0.0)), ASPECTS);
    assert_eq!(camera.pose(), Pose::globe(longitude, 0.0, 2.5));
    // A pole is no place that a camera goes beyond.
    let mut camera = Controller::new(Pose::globe(0.0, 1.5, 0.3));
    (0..200).for_each(|_| camera.apply(Move::Grab(DVec2::ZERO, DVec2::new(0.0, 0.05)), ASPECTS));
    let Pose::Globe { latitude, .. } = camera.pose() else { unreachable!() };
    assert!(latitude.is_finite() && latitude <= std::f64::consts::FRAC_PI_2);
}

#[test]
fn two_fingers_drag_and_zoom_at_once() {
    let (pose, point) = (Pose::image(DVec2::splat(0.5), 4.0), DVec2::new(0.1, 0.2));
    let (mut camera, mut in_turn) = (Controller::new(pose), Controller::new(pose));
    camera.apply(Move::Pinch(DVec2::new(0.05, 0.0), 1.5, point), ASPECTS);
    in_turn.apply(Move::Drag(DVec2::new(0.05, 0.0)), ASPECTS);
    in_turn.apply(Move::ZoomTo(1.5, point), ASPECTS);
    assert_eq!(camera, in_turn);
}

#[test]
fn small_steps_add_up() {
    let zoom = 1e9;
    for pose in [Pose::image(DVec2::new(0.7, 0.6), zoom), Pose::globe(3.1, 0.0, 1.0 / zoom)] {
        let (mut camera, pan) = (Controller::new(pose), DVec2::new(0.013, 0.0));
        (0..100_000).for_each(|_| camera.apply(Move::Drag(pan), ASPECTS));
        let at_once = pose.dragged(pan * 1e5, ASPECTS[0], ASPECTS[1]);
        let apart = camera.pose().over().distance(at_once.over());
        assert!(apart < 1e-15, "{apart} from {pose:?}");
    }
}

#[test]
fn nothing_is_owed_beyond_an_edge() {
    let mut camera = Controller::new(Pose::image(DVec2::ZERO, 1.0));
    camera.apply(Move::Drag(DVec2::ONE), ASPECTS);
    assert_eq!(camera.pose().over(), DVec2::ZERO);
    camera.apply(Move::Drag(DVec2::new(-0.1, 0.0)), ASPECTS);
    assert!(camera.pose().over().x > 0.0);
}
