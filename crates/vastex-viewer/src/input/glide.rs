//! What goes on by itself where it is let go in motion, by a pointer or by fingers on a touchpad, until
//! friction has it at rest.

use std::time::Duration;

use glam::DVec2;

/// A drag whose last part was at least so fast, in view heights a second, goes on by itself when the pointer
/// is let go, no faster than the second speed, and ends below the third. By friction the speed falls by so
/// much of itself in a second.
const FASTEST_STILL: f64 = 0.15;
pub(super) const FASTEST_GLIDE: f64 = 6.0;
const SLOWEST_GLIDE: f64 = 0.01;
pub(super) const FRICTION: f64 = 5.0;
/// The time over which that speed is measured, at most and at least: events that waited for a frame come all
/// at once.
const MEASURED: [Duration; 2] = [Duration::from_millis(100), Duration::from_millis(50)];

/// When and where something was lately that is moved.
#[derive(Debug, Default)]
pub(super) struct Trail(Vec<(Duration, DVec2)>);

impl Trail {
    /// Something else is moved.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// The pointer is there now, in pixels.
    pub(super) fn push(&mut self, now: Duration, place: DVec2) {
        self.0.retain(|(then, _)| now.saturating_sub(*then) <= MEASURED[0]);
        self.0.push((now, place));
    }

    /// The pointer was moved by so many pixels.
    pub(super) fn push_by(&mut self, now: Duration, delta: DVec2) {
        let lately = self.0.last().filter(|(then, _)| now.saturating_sub(*then) <= MEASURED[0]);
        // Since when a first step has been under way nobody knows.
        let place = lately.map_or(DVec2::ZERO, |(_, before)| before + delta);
        self.push(now, place);
    }

    /// How fast it was lately, in pixels a second. What stood still before it was let go is slow.
    pub(super) fn speed(&self, now: Duration) -> DVec2 {
        let mut lately = self.0.iter().filter(|(then, _)| now.saturating_sub(*then) <= MEASURED[0]);
        let (Some((then, from)), Some((_, to))) = (lately.next(), lately.next_back()) else {
            return DVec2::ZERO;
        };
        (to - from) / now.saturating_sub(*then).max(MEASURED[1]).as_secs_f64()
    }
}

/// What goes on by itself, in view heights a second.
#[derive(Debug, Default)]
pub(super) struct Glide(DVec2);

impl Glide {
    /// What was let go at a speed goes on, if it was fast enough, and else rests.
    pub(super) fn begin(&mut self, speed: DVec2) {
        let is_fast = speed.length() >= FASTEST_STILL;
        self.0 = if is_fast { speed.clamp_length_max(FASTEST_GLIDE) } else { DVec2::ZERO };
    }

    /// Stops the glide.
    pub(super) fn stop(&mut self) {
        self.0 = DVec2::ZERO;
    }

    /// Returns true if anything goes on.
    pub(super) fn is_going(&self) -> bool {
        self.0 != DVec2::ZERO
    }

    /// By how much it goes on in a time.
    pub(super) fn step(&mut self, time: Duration) -> DVec2 {
        // The speed falls by friction; what it comes to meanwhile is its integral.
        let left = (-FRICTION * time.as_secs_f64()).exp();
        let delta = self.0 * (1.0 - left) / FRICTION;
        self.0 *= left;
        if self.0.length() < SLOWEST_GLIDE {
            self.stop();
        }
        delta
    }
}
