//! What is made of a window that refuses a picture: how often it is asked in a frame, and for how long.

use std::time::{Duration, Instant};

/// How often a window is asked for the picture of a frame.
const ATTEMPTS: u32 = 3;
/// So long, and in so many frames, a window may refuse its pictures. When it is hidden few frames are drawn.
const LONGEST: Duration = Duration::from_secs(10);
const MOST_FRAMES: u32 = 10;

/// What comes of asking the window for a picture.
pub(super) enum Attempt<Frame> {
    Picture(Frame),
    /// There is none at the moment, and asking again is of no use.
    NoneNow,
    /// The surface is of another size of the window.
    Outdated,
    /// Why there is none; another attempt may have one.
    Refused(String),
    /// Why there is none in this frame: the surface is made anew in the next one, before which the device is
    /// looked at.
    Lost(String),
}

/// Attempts to have a picture, some where it is refused. Gives it, or why there is none, or nothing where the
/// window has none at the moment.
pub(super) fn attempts<Frame>(
    mut attempt: impl FnMut() -> Attempt<Frame>,
) -> (Option<Frame>, Option<String>) {
    let mut refused = None;
    for _ in 0..ATTEMPTS {
        match attempt() {
            Attempt::Picture(frame) => return (Some(frame), None),
            Attempt::NoneNow => break,
            Attempt::Outdated => {}
            Attempt::Refused(why) => refused = Some(why),
            Attempt::Lost(why) => return (None, Some(why)),
        }
    }
    (None, refused)
}

/// The frames in a row for which a window refused a picture.
#[derive(Default)]
pub(super) struct Refusals {
    since: Option<Instant>,
    frames: u32,
}

impl Refusals {
    /// A frame was refused or not. Returns true if they have been refused for too long.
    pub(super) fn note(&mut self, is_refused: bool, now: Instant) -> bool {
        if !is_refused {
            *self = Refusals::default();
            return false;
        }
        self.frames = self.frames.saturating_add(1);
        let since = *self.since.get_or_insert(now);
        self.frames > MOST_FRAMES && now.duration_since(since) >= LONGEST
    }

    /// Returns true if the last frame was refused, and the one before it was not.
    pub(super) fn is_first(&self) -> bool {
        self.frames == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes of these attempts, and how many of them there were.
    fn comes_of(all: Vec<Attempt<u32>>) -> (Option<u32>, Option<String>, usize) {
        let (count, mut left) = (all.len(), all.into_iter());
        let (frame, why) = attempts(|| left.next().unwrap());
        (frame, why, count - left.len())
    }

    #[test]
    fn a_window_that_refuses_is_asked_again_and_one_without_its_surface_is_not() {
        let refused = || Attempt::Refused("in use".to_owned());
        let why = Some("in use".to_owned());
        // Nothing is to be said where the same frame has a picture after all.
        assert_eq!(comes_of(vec![refused(), Attempt::Picture(7)]), (Some(7), None, 2));
        assert_eq!(comes_of(vec![Attempt::Outdated, Attempt::Picture(7)]), (Some(7), None, 2));
        assert_eq!(comes_of(vec![refused(), refused(), refused(), Attempt::Picture(7)]), (None, why, 3));
        assert_eq!(comes_of(vec![Attempt::NoneNow, Attempt::Picture(7)]), (None, None, 1));
        // The device may be lost as well, which the next frame finds before it makes another surface.
        let lost = Attempt::Lost("lost".to_owned());
        assert_eq!(comes_of(vec![lost, Attempt::Picture(7)]), (None, Some("lost".to_owned()), 1));
    }

    #[test]
    fn refusals_that_last_end_the_program_and_few_of_them_do_not() {
        let begun = Instant::now();
        let at = |seconds: u64| begun + Duration::from_secs(seconds);
        let mut refusals = Refusals::default();
        // A window that is hidden is drawn seldom.
        assert!(!refusals.note(true, at(0)) && refusals.is_first());
        assert!(!refusals.note(true, at(60)) && !refusals.is_first());
        assert!(!refusals.note(false, at(61)));
        assert!(!refusals.note(true, at(62)) && refusals.is_first(), "and is told of again");
        assert!((0..100).all(|_| !refusals.note(true, at(71))), "for a moment");
        assert!(refusals.note(true, at(72)));
        assert!(!refusals.note(false, at(73)) && !refusals.note(true, at(74)));
    }
}
