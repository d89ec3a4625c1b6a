//! Moves a camera, and keeps what f64 rounds away of each step for the next, so that many small steps end
//! where their sum says.

use glam::DVec2;

use super::orientation::Orientation;
use super::over_heights::GroundHeights;
use super::pose::Pose;

/// A change of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Move {
    /// Dragged, in view heights; on a globe as if by the middle of the view.
    Drag(DVec2),
    /// The pointer took hold of a place, in view heights from the middle, and is at another one.
    Grab(DVec2, DVec2),
    /// Turned to the right and tilted towards the horizon round the point in the middle of the view, in
    /// radians; not an image.
    Orbit(DVec2),
    /// Looking straight down, north upwards; over a plane, north.
    Upright,
    /// Zoomed in by a factor towards a point, in view heights from the middle.
    ZoomTo(f64, DVec2),
    /// An image turned clockwise by so many degrees, as it is seen, round the middle of the view.
    Turn(f64),
    /// Left and right of an image exchanged, as it is seen, or top and bottom.
    Flip {
        /// True to exchange top and bottom, false for left and right.
        is_vertical: bool,
    },
    /// Two fingers: dragged, then zoomed in by a factor towards a point, in view heights, the point from the
    /// middle.
    Pinch(DVec2, f64, DVec2),
    /// Walked by a step and zoomed by a factor.
    Walk(DVec2, f64),
    /// To the edge of an image on a side, to the right and downwards as it is seen; where all of it has room,
    /// to its middle. Not elsewhere.
    ToEdge(DVec2),
    /// On by a whole view of an image to a side, to the right and downwards as it is seen, no further than to
    /// its edge. Not elsewhere.
    Screens(DVec2),
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

    /// Where the camera is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Carries out a move over ground with heights, if there are any: the point of the ground under the
    /// pointer stays under it, and the camera turns round the point in the middle. If no ground is seen
    /// there, and for all other moves, the ground counts as level, at its height below the camera.
    pub fn apply_over(&mut self, moved: Move, aspects: Aspects, heights: Option<&mut dyn GroundHeights>) {
        let Some(heights) = heights else { return self.apply(moved, aspects) };
        let pose = self.pose;
        let found = match moved {
            Move::Grab(from, to) => pose.grabbed_over(from, to, heights),
            Move::Orbit(angles) => pose.orbited_over(angles.x, angles.y, heights),
            Move::Upright => pose.uprighted_over(heights),
            Move::ZoomTo(factor, point) => pose.zoomed_over(factor, point, heights),
            Move::Pinch(delta, factor, point) => {
                self.apply_over(Move::Grab(point - delta, point), aspects, Some(&mut *heights));
                return self.apply_over(Move::ZoomTo(factor, point), aspects, Some(heights));
            }
            // Images, and moves beside all ground.
            _ => None,
        };
        match found {
            Some(pose) => self.turn_to(pose),
            None => self.apply(moved, aspects),
        }
    }

    /// Carries a move out.
    pub fn apply(&mut self, moved: Move, aspects: Aspects) {
        match moved {
            Move::Drag(delta) => self.drag(delta, aspects),
            Move::Grab(from, to) => self.grab(from, to, aspects),
            Move::Orbit(angles) => self.turn_to(self.pose.orbited(angles.x, angles.y)),
            Move::Upright => self.turn_to(self.pose.uprighted()),
            Move::ZoomTo(factor, point) => self.zoom_to(factor, point, aspects),
            Move::Pinch(delta, factor, point) => {
                self.grab(point - delta, point, aspects);
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
            Move::ToEdge(side) => self.turn_to(self.pose.at_edge(side, aspects)),
            Move::Screens(side) => self.turn_to(self.pose.a_view_on(side, aspects)),
        }
    }

    /// Shows an image with so many pixels a texel, towards a point of a view of `view` pixels, in view
    /// heights from the middle; `image` has the image's texels. At whole numbers and their reciprocals texels
    /// begin where pixels do, so that none is blended with its neighbours. Does nothing in scenes with
    /// perspective.
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

    fn turn_to(&mut self, pose: Pose) {
        if pose != self.pose {
            (self.pose, self.rest) = (pose, DVec2::ZERO);
        }
    }

    /// Brings what is seen at a place of the view to another one. Where no ground is there, or it cannot be
    /// brought there, the view is dragged by as much.
    fn grab(&mut self, from: DVec2, to: DVec2, aspects: Aspects) {
        let held = self.pose.ground_at(from).and_then(|ground| self.pose.seeing(ground.place, to));
        match held {
            Some(pose) => self.turn_to(pose),
            None => self.drag(to - from, aspects),
        }
    }

    fn zoom_to(&mut self, factor: f64, point: DVec2, aspects: Aspects) {
        let Pose::Image { .. } = self.pose else {
            let ground = self.pose.ground_at(point);
            let zoomed = self.pose.zoomed(factor);
            let held = ground.and_then(|ground| zoomed.seeing(ground.place, point));
            return self.turn_to(held.unwrap_or(zoomed));
        };
        self.drag(-point, aspects);
        self.pose = self.pose.zoomed(factor);
        self.drag(point, aspects);
    }

    fn drag(&mut self, delta: DVec2, [view, image]: Aspects) {
        let (before, step) = (self.pose.over(), self.pose.drag(delta, view, image) + self.rest);
        let sum = before + step;
        self.pose = self.pose.at(sum);
        // What the sum lost; nothing is owed beyond an edge.
        self.rest = if self.pose.over() == sum { step - (sum - before) } else { DVec2::ZERO };
    }
}

#[cfg(test)]
mod tests;
