//! Motion: where a camera will be that goes on as it does.
//!
//! An application knows its camera's position, velocity and turn rate, or its last poses, and draws what it
//! expects to see when tiles that are asked for now will be here ([`Pager::expect`](crate::Pager::expect)).
//! How many frames that is, [`Pager::arrival_frames`](crate::Pager::arrival_frames) measures. What the
//! position is of (a point in the world, a point of an image, a longitude and a latitude) is the
//! application's business, as is how its camera turns to look.

use crate::wanted::vector::{Vec3, angle, cross, dot, length, sub_scaled};

/// A position that moves at an even speed along a line, or along a circle or a screw where the velocity
/// turns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Where the camera is now.
    pub position: [f64; 3],
    /// By how much it moves in a frame, now.
    pub velocity: [f64; 3],
    /// The axis around which the velocity turns, and whatever turns with it; its length is the angle in
    /// radians by which that turns in a frame, to the left seen from the axis' tip.
    pub turn: [f64; 3],
}

impl Motion {
    /// The motion that has led through three positions in as many frames, the oldest first.
    pub fn through([first, second, now]: [[f64; 3]; 3]) -> Motion {
        let [before, step] = [sub_scaled(second, 1.0, first), sub_scaled(now, 1.0, second)];
        let axis = cross(before, step);
        let rate = if length(axis) > 0.0 { angle(before, step) / length(axis) } else { 0.0 };
        let turn = axis.map(|n| n * rate);
        // The step is the chord of the last frame: the velocity now has turned on by half the angle, and the
        // arc is longer.
        let still = Motion { position: now, velocity: step, turn };
        let half = length(turn) / 2.0;
        let longer = if half > 0.0 { half / half.sin() } else { 1.0 };
        Motion { velocity: still.turned(step, 0.5).map(|n| n * longer), ..still }
    }

    /// Where the camera will be after so many frames.
    pub fn position_after(&self, frames: f64) -> [f64; 3] {
        let rate = length(self.turn);
        let angle = rate * frames;
        // Along the arc: how far ahead, and how far towards the side to which it turns.
        let (ahead, aside) =
            if angle.abs() < 1e-6 { (frames, 0.0) } else { (angle.sin() / rate, (1.0 - angle.cos()) / rate) };
        let Some(axis) = self.axis() else { return sub_scaled(self.position, -frames, self.velocity) };
        let along = axis.map(|n| n * dot(axis, self.velocity));
        let across = sub_scaled(self.velocity, 1.0, along);
        let side = cross(axis, across);
        std::array::from_fn(|n| self.position[n] + along[n] * frames + across[n] * ahead + side[n] * aside)
    }

    /// A direction that turns as the velocity does, after so many frames: where a camera will look that turns
    /// with its way.
    pub fn turned(&self, direction: [f64; 3], frames: f64) -> [f64; 3] {
        let Some(axis) = self.axis() else { return direction };
        let (sin, cos) = (length(self.turn) * frames).sin_cos();
        let (side, along) = (cross(axis, direction), dot(axis, direction) * (1.0 - cos));
        std::array::from_fn(|n| direction[n] * cos + side[n] * sin + axis[n] * along)
    }

    /// Of length 1; `None` if nothing turns.
    fn axis(&self) -> Option<Vec3> {
        let rate = length(self.turn);
        (rate > 0.0).then(|| self.turn.map(|n| n / rate))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn is_near(a: Vec3, b: Vec3, within: f64) -> bool {
        length(sub_scaled(a, 1.0, b)) <= within
    }

    #[test]
    fn a_straight_way_goes_on_straight() {
        let motion = Motion::through([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [2.0, 4.0, 0.0]]);
        assert_eq!((motion.velocity, motion.turn), ([1.0, 2.0, 0.0], [0.0; 3]));
        assert_eq!(motion.position_after(3.0), [5.0, 10.0, 0.0]);
        let still = Motion::through([[1.0, 2.0, 3.0]; 3]);
        assert_eq!(still.position_after(100.0), [1.0, 2.0, 3.0]);
    }

    proptest! {
        #[test]
        fn a_circle_stays_a_circle(
            centre in prop::array::uniform3(-5.0f64..5.0),
            axis in prop::array::uniform3(-1.0f64..1.0),
            radius in 0.1f64..3.0,
            rate in -0.3f64..0.3,
            frames in 0.0f64..60.0,
        ) {
            prop_assume!(length(axis) > 0.1 && rate.abs() > 1e-3);
            let axis = axis.map(|n| n / length(axis));
            let aside = if axis[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let x = cross(axis, aside);
            let x = x.map(|n| n / length(x));
            let y = cross(axis, x);
            let at = |frame: f64| -> Vec3 {
                let (sin, cos) = (rate * frame).sin_cos();
                std::array::from_fn(|n| centre[n] + radius * (x[n] * cos + y[n] * sin))
            };
            let motion = Motion::through([at(-2.0), at(-1.0), at(0.0)]);
            prop_assert!(is_near(motion.position_after(frames), at(frames), 1e-6));
            // What looks along the way goes on doing so.
            let step = sub_scaled(at(frames + 1e-6), 1.0, at(frames - 1e-6)).map(|n| n / 2e-6);
            prop_assert!(is_near(motion.turned(motion.velocity, frames), step, 1e-6));
        }
    }
}
