//! A camera that goes by itself: noted while a person moves it, and led along the path that comes of that.
//!
//! A host brings the clock: all times are since one moment of its own.

use std::time::Duration;

use super::keyframes::CameraPath;
use super::places::PathPlace;
use super::pose::Pose;

/// Pictures a second that a recorded path says.
const RATE: f64 = 30.0;
/// Seconds between two places that are noted.
const STEP: f64 = 0.033;
/// Places of one recording: half an hour of motion.
const MOST_NOTED: usize = 60_000;

/// What becomes of a camera by itself, and what is noted of it.
#[derive(Debug)]
pub struct Flight<P = Pose> {
    recording: Option<Vec<(f64, P)>>,
    path: Option<CameraPath<P>>,
    /// When it began.
    playing: Option<Duration>,
}

impl<P> Default for Flight<P> {
    /// Nothing is noted, and there is no path.
    fn default() -> Flight<P> {
        Flight { recording: None, path: None, playing: None }
    }
}

impl<P: PathPlace> Flight<P> {
    /// Returns true if the camera is moved by a path.
    pub fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    /// Returns true if it is noted where the camera goes.
    pub fn is_recording(&self) -> bool {
        self.recording.is_some()
    }

    /// The path that was recorded or set last.
    pub fn path(&self) -> Option<&CameraPath<P>> {
        self.path.as_ref()
    }

    /// Takes note of where the camera is, if that is recorded. Places less than 33 ms after the last one
    /// noted are left out, and so are all after half an hour of motion.
    pub fn note(&mut self, now: Duration, place: P) {
        let Some(noted) = &mut self.recording else { return };
        let time = now.as_secs_f64();
        match noted.last().copied() {
            Some((_, last)) if last == place => {}
            Some((before, _)) if time - before < STEP => {}
            // A window at rest draws no frames: the camera stood there until now.
            Some((before, last)) if time - before > 3.0 * STEP => {
                noted.extend([(time - STEP, last), (time, place)]);
            }
            _ => noted.push((time, place)),
        }
        noted.truncate(MOST_NOTED);
    }

    /// Begins to note where the camera is. What is played ends.
    pub fn begin_recording(&mut self, now: Duration, place: P) {
        self.playing = None;
        self.recording = Some(vec![(now.as_secs_f64(), place)]);
    }

    /// Ends that where the camera is now. `recorded` makes the path of the places and their times in seconds,
    /// with so many pictures a second. Returns the path; `None` if nothing was recorded.
    pub fn end_recording_with(
        &mut self,
        (now, place): (Duration, P),
        recorded: impl FnOnce(f64, &[(f64, P)]) -> Option<CameraPath<P>>,
    ) -> Option<&CameraPath<P>> {
        self.note(now, place);
        let mut noted = self.recording.take()?;
        // It ends where the camera is, when it was there last.
        match noted.last().copied() {
            Some((time, last)) if last != place || now.as_secs_f64() - time > STEP => {
                noted.push((now.as_secs_f64(), place));
            }
            _ => {}
        }
        self.path = Some(recorded(RATE, &noted)?);
        self.path.as_ref()
    }

    /// Forgets what was noted.
    pub fn drop_recording(&mut self) {
        self.recording = None;
    }

    /// From now on this is the path to be played. What is played ends.
    pub fn set_path(&mut self, path: CameraPath<P>) {
        (self.path, self.playing) = (Some(path), None);
    }

    /// Begins to play the path. Returns where it begins; `None` if there is no path.
    pub fn play(&mut self, now: Duration) -> Option<P> {
        let first = self.path.as_ref()?.pose(0.0);
        self.playing = Some(now);
        Some(first)
    }

    /// The camera is moved by somebody else.
    pub fn stop(&mut self) {
        self.playing = None;
    }

    /// Where the path has the camera at a time, if it is played. It stops at its end.
    pub fn pose(&mut self, now: Duration) -> Option<P> {
        let (path, begun) = (self.path.as_ref()?, self.playing?);
        let time = now.saturating_sub(begun).as_secs_f64();
        if time >= path.seconds() {
            self.playing = None;
        }
        Some(path.pose(time))
    }
}

impl Flight {
    /// Ends the recording of a camera where it is now. Returns its path; `None` if nothing was recorded.
    pub fn end_recording(&mut self, now: Duration, pose: Pose) -> Option<&CameraPath> {
        self.end_recording_with((now, pose), CameraPath::recorded)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    fn at(x: f64) -> Pose {
        Pose::image(DVec2::new(x, 0.5), 2.0)
    }

    #[test]
    fn what_is_recorded_is_played_again() {
        let seconds = Duration::from_secs_f64;
        let mut flight = Flight::default();
        assert_eq!(flight.play(seconds(0.0)), None);
        flight.begin_recording(seconds(10.0), at(0.1));
        (1..=60)
            .for_each(|n| flight.note(seconds(10.0 + f64::from(n) / 60.0), at(0.1 + 0.005 * f64::from(n))));
        // A rest of two seconds without a frame, then a jump.
        flight.note(seconds(13.0), at(0.8));
        let keys = flight.end_recording(seconds(14.0), at(0.8)).unwrap().keys().len();
        assert!(keys < 14 && !flight.is_recording(), "{keys}");
        assert!(flight.end_recording(seconds(15.0), at(0.8)).is_none(), "nothing is recorded");
        assert_eq!(flight.play(seconds(100.0)), Some(at(0.1)));
        let x = |pose: Option<Pose>| match pose {
            Some(Pose::Image { centre, .. }) => centre.x,
            other => panic!("{other:?}"),
        };
        assert!((x(flight.pose(seconds(100.5))) - 0.25).abs() < 0.003);
        assert!((x(flight.pose(seconds(102.0))) - 0.4).abs() < 0.003, "it rests");
        assert!(flight.is_playing());
        assert_eq!(flight.pose(seconds(105.0)), Some(at(0.8)));
        assert!(!flight.is_playing() && flight.pose(seconds(106.0)).is_none());
        // The same from its text.
        let text = flight.path().unwrap().to_text([1000, 500]);
        let mut again = Flight::default();
        again.set_path(CameraPath::from_text(&text, [1000, 500]).unwrap());
        assert!((x(again.play(seconds(0.0))) - 0.1).abs() < 1e-12);
        again.stop();
        assert_eq!(again.pose(seconds(0.5)), None);
    }
}
