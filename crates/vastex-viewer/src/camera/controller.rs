//! Moves a camera, and keeps what f64 rounds away of each step for the next, so that many small steps end where their sum says.

use glam::DVec2;

use super::orientation::Orientation;
use super::pose::Pose;

/// A change of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Move {
    /// The pointer was dragged, in view heights.
    Drag(DVec2),
    /// Zoomed in by a factor towards a point, in view heights from the middle.
    ZoomTo(f64, DVec2),
    /// An image turned clockwise by so many degrees, as it is seen, round the middle of the view.
    Turn(f64),
    /// Left and right of an image exchanged, as it is seen, or top and bottom.
    Flip {
        /// Whether it is top and bottom.
        is_vertical: bool,
    },
    /// Two fingers: dragged, then zoomed in by a factor towards a point, in view heights, the point from the middle.
    Pinch(DVec2, f64, DVec2),
    /// Walked by a step and zoomed by a factor.
    Walk(DVec2, f64),
}

/// Width over height of the view and of the image.
pub type Aspects = [f64; 2];

/// A camera that is moved step by step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    pose: Pose,
    /// What is left of the steps so far, beside what the pose is over.
    rest: DVec2,
}

impl Controller {
    /// A camera at a pose.
    pub fn new(pose: Pose) -> Controller {
        Controller { pose, rest: DVec2::ZERO }
    }

    /// Where it is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Carries a move out.
    pub fn apply(&mut self, moved: Move, aspects: Aspects) {
        match moved {
            Move::Drag(delta) => self.drag(delta, aspects),
            Move::ZoomTo(factor, point) => self.zoom_to(factor, point, aspects),
            Move::Pinch(delta, factor, point) => {
                self.drag(delta, aspects);
                self.zoom_to(factor, point, aspects);
            }
            Move::Turn(degrees) => self.orient(self.pose.orientation().turned(degrees), aspects),
            Move::Flip { is_vertical } => {
                let turn = if is_vertical { 180.0 } else { 0.0 };
                self.orient(self.pose.orientation().mirrored().turned(turn), aspects);
            }
            Move::Walk(step, factor) => {
                let [_, image] = aspects;
                self.pose = self.pose.walked(step, image).zoomed(factor);
                self.rest = DVec2::ZERO;
            }
        }
    }

    /// Shows an image with so many pixels a texel, towards a point of a view of `view` pixels, in view heights from the middle; `image`
    /// has the image's texels. At whole numbers and their reciprocals texels begin where pixels do, so that none is blended with
    /// its neighbours. Does nothing in scenes with perspective.
    pub fn magnify(&mut self, magnification: f64, point: DVec2, view: [u32; 2], image: [u32; 2]) {
        let Some(before) = self.pose.magnification(view, image) else { return };
        let aspect = |[width, height]: [u32; 2]| f64::from(width.max(1)) / f64::from(height.max(1));
        self.zoom_to(magnification / before, point, [aspect(view), aspect(image)]);
        // A small image in a large view may be smaller than any camera zooms out.
        if let Pose::Image { centre, zoom, orientation } = self.pose
            && let Some(reached) = self.pose.magnification(view, image)
        {
            self.pose = Pose::Image { centre, zoom: zoom * magnification / reached, orientation };
        }
        self.pose = self.pose.aligned(view, image);
        self.rest = DVec2::ZERO;
    }

    fn orient(&mut self, orientation: Orientation, [view, image]: Aspects) {
        self.pose = self.pose.with_orientation(orientation, view, image);
        self.rest = DVec2::ZERO;
    }

    fn zoom_to(&mut self, factor: f64, point: DVec2, aspects: Aspects) {
        // Turning about on the plane would not keep the point below the pointer.
        let is_kept = !matches!(self.pose, Pose::Plane { .. });
        if is_kept {
            self.drag(-point, aspects);
        }
        self.pose = self.pose.zoomed(factor);
        if is_kept {
            self.drag(point, aspects);
        }
    }

    fn drag(&mut self, delta: DVec2, [view, image]: Aspects) {
        if matches!(self.pose, Pose::Plane { .. }) {
            self.pose = self.pose.dragged(delta, view, image);
            return;
        }
        let (before, step) = (self.pose.over(), self.pose.drag(delta, view, image) + self.rest);
        let sum = before + step;
        self.pose = self.pose.at(sum);
        // What the sum lost; nothing is owed beyond an edge.
        self.rest = if self.pose.over() == sum { step - (sum - before) } else { DVec2::ZERO };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for moves in
            [[Move::Turn(90.0), Move::Turn(0.0)], [Move::Turn(-20.0), Move::Flip { is_vertical: true }]]
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
        for pose in [
            Pose::image(DVec2::new(0.7, 0.6), zoom),
            Pose::Globe { longitude: 3.1, latitude: 0.0, altitude: 1.0 / zoom },
        ] {
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
}
