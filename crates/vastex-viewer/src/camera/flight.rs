//! A camera that goes by itself: noted while a person moves it, and led along the path that comes of that.
//!
//! A host brings the clock: all times are since one moment of its own.

use std::fmt;
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
/// Seconds by which the end of a path may differ from that of its recording, as times are written.
const ROUNDING: f64 = 0.01;

/// The path of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded<'a, P = Pose> {
    /// The path.
    pub path: &'a CameraPath<P>,
    /// The end of the recording, if the path does not have it.
    pub left_out: Option<LeftOut>,
}

/// The end of a recording, which its path does not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// How long the path is, in seconds: what was recorded after that is left out.
    pub after: f64,
    /// Why it is.
    pub why: WhyLeftOut,
}

/// Why a path does not have all that was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhyLeftOut {
    /// Another scene, or another volume, was shown from then on: a path has one.
    Another,
    /// A recording has at most 60,000 places, half an hour of motion, and takes a day at most.
    TooLong,
}

impl fmt::Display for LeftOut {
    /// The same as a sentence for people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why = match self.why {
            WhyLeftOut::Another => "another scene was shown then, and a path has one",
            WhyLeftOut::TooLong => "a recording has 60000 places, half an hour of motion, at most",
        };
        write!(f, "what came after {:.1} s is left out: {why}", self.after)
    }
}

/// What is noted of a camera.
#[derive(Debug)]
struct Recording<P> {
    /// Times in seconds and places; one at least.
    noted: Vec<(f64, P)>,
    /// True if there were more than may be noted.
    is_full: bool,
}

/// What becomes of a camera by itself, and what is noted of it.
#[derive(Debug)]
pub struct Flight<P = Pose> {
    recording: Option<Recording<P>>,
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
        let Some(Recording { noted, is_full }) = &mut self.recording else { return };
        if *is_full {
            return;
        }
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
        *is_full = noted.len() > MOST_NOTED;
        noted.truncate(MOST_NOTED);
    }

    /// Begins to note where the camera is. What is played ends.
    pub fn begin_recording(&mut self, now: Duration, place: P) {
        self.playing = None;
        self.recording = Some(Recording { noted: vec![(now.as_secs_f64(), place)], is_full: false });
    }

    /// Ends that: where the camera is now, or without a place where it was noted last. `recorded` makes the
    /// path of the places and their times in seconds, with so many pictures a second. The path can be played
    /// from now on. Returns `None` if nothing was recorded.
    pub fn end_recording_with(
        &mut self,
        (now, place): (Duration, Option<P>),
        recorded: impl FnOnce(f64, &[(f64, P)]) -> Option<CameraPath<P>>,
    ) -> Option<Recorded<'_, P>> {
        place.into_iter().for_each(|place| self.note(now, place));
        let Recording { mut noted, is_full } = self.recording.take()?;
        // It ends where the camera is, when it was there last.
        match (place, noted.last().copied()) {
            (Some(place), Some((time, last)))
                if !is_full && (last != place || now.as_secs_f64() - time > STEP) =>
            {
                noted.push((now.as_secs_f64(), place));
            }
            _ => {}
        }
        let path = &*self.path.insert(recorded(RATE, &noted)?);
        let (begin, first) = noted.first()?;
        let (end, _) = noted.last()?;
        let after = path.seconds();
        let why = match () {
            () if noted.iter().any(|(_, place)| place.kind() != first.kind()) => Some(WhyLeftOut::Another),
            () if is_full || end - begin > after + ROUNDING => Some(WhyLeftOut::TooLong),
            () => None,
        };
        Some(Recorded { path, left_out: why.map(|why| LeftOut { after, why }) })
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
    /// Ends the recording of a camera where it is now. The path can be played from now on. Returns `None` if
    /// nothing was recorded.
    pub fn end_recording(&mut self, now: Duration, pose: Pose) -> Option<Recorded<'_>> {
        self.end_recording_with((now, Some(pose)), CameraPath::recorded)
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
        let recorded = flight.end_recording(seconds(14.0), at(0.8)).unwrap();
        assert_eq!(recorded.left_out, None);
        let keys = recorded.path.keys().len();
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

    #[test]
    fn what_another_scene_was_shown_for_is_said_to_be_left_out() {
        let seconds = Duration::from_secs_f64;
        let mut flight = Flight::default();
        flight.begin_recording(seconds(10.0), at(0.1));
        flight.note(seconds(11.0), at(0.2));
        flight.note(seconds(12.0), Pose::globe(0.0, 0.0, 2.0));
        flight.note(seconds(15.0), Pose::globe(1.0, 0.0, 2.0));
        // Back on the first one, too: a path is no shorter than what it says.
        let Recorded { path, left_out } = flight.end_recording(seconds(20.0), at(0.3)).unwrap();
        let left_out = left_out.unwrap();
        assert_eq!((left_out.why, left_out.after), (WhyLeftOut::Another, path.seconds()));
        assert!((1.9..2.0).contains(&path.seconds()), "{}", path.seconds());
        let said = left_out.to_string();
        assert!(said.starts_with("what came after 2.0 s is left out: another scene"), "{said}");
        assert_eq!(flight.play(seconds(30.0)), Some(at(0.1)), "what there is can be played");
    }

    #[test]
    fn a_recording_that_is_too_long_is_said_to_be() {
        let time = |n: usize| Duration::from_secs_f64(n as f64 * 0.04);
        let place = |n: usize| at(0.5 + 0.3 * (n as f64 / 20_000.0).sin());
        for (count, is_whole) in [(MOST_NOTED - 1, true), (MOST_NOTED + 5, false)] {
            let mut flight = Flight::default();
            flight.begin_recording(time(0), place(0));
            (1..=count).for_each(|n| flight.note(time(n), place(n)));
            let Recorded { path, left_out } = flight.end_recording(time(count), place(count)).unwrap();
            let end = time(count.min(MOST_NOTED - 1)).as_secs_f64();
            assert!((path.seconds() - end).abs() < 1e-3, "{count}: {}", path.seconds());
            let why = left_out.map(|left_out| left_out.why);
            assert_eq!(why, (!is_whole).then_some(WhyLeftOut::TooLong), "{count}");
        }
    }

    /// The window may close when the camera is elsewhere.
    #[test]
    fn a_recording_ends_without_a_place_where_the_camera_was_noted_last() {
        let seconds = Duration::from_secs_f64;
        let mut flight = Flight::default();
        flight.begin_recording(seconds(0.0), at(0.1));
        flight.note(seconds(0.04), at(0.2));
        let recorded = flight.end_recording_with((seconds(9.0), None), CameraPath::recorded).unwrap();
        assert_eq!((recorded.path.keys().last(), recorded.left_out), (Some(&(0.04, at(0.2))), None));
    }
}
