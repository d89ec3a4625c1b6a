//! Moves a camera, and keeps what f64 rounds away of each step for the next, so that many small steps end where their sum says.

use glam::DVec2;

use super::pose::Pose;

/// A change of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Move {
    /// The pointer was dragged, in view heights.
    Drag(DVec2),
    /// Zoomed in by a factor towards a point, in view heights from the middle.
    ZoomTo(f64, DVec2),
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
            Move::ZoomTo(factor, point) => {
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
            Move::Walk(step, factor) => {
                self.pose = self.pose.walked(step).zoomed(factor);
                self.rest = DVec2::ZERO;
            }
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
        let pose = Pose::Image { centre: DVec2::splat(0.5), zoom: 2.0 };
        // A drag by -point brings what lies below the pointer to the middle.
        let below = |pose: Pose| pose.dragged(-point, ASPECTS[0], ASPECTS[1]).over();
        let mut camera = Controller::new(pose);
        camera.apply(Move::ZoomTo(1.25, point), ASPECTS);
        assert!(below(pose).distance(below(camera.pose())) < 1e-12);
        assert_ne!(pose, camera.pose());
    }

    #[test]
    fn small_steps_add_up() {
        let zoom = 1e9;
        for pose in [
            Pose::Image { centre: DVec2::new(0.7, 0.6), zoom },
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
        let mut camera = Controller::new(Pose::Image { centre: DVec2::ZERO, zoom: 1.0 });
        camera.apply(Move::Drag(DVec2::ONE), ASPECTS);
        assert_eq!(camera.pose().over(), DVec2::ZERO);
        camera.apply(Move::Drag(DVec2::new(-0.1, 0.0)), ASPECTS);
        assert!(camera.pose().over().x > 0.0);
    }
}
