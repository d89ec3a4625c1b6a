//! Camera paths in the window: recorded while a person moves, written into a file, and played.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result};
use vastex_scenes::Pose;
use vastex_viewer::CameraPath;

use crate::output::Output;

/// Pictures a second that a recorded path says.
const RATE: f64 = 30.0;
/// Between two poses that are noted.
const STEP: Duration = Duration::from_millis(33);
/// Poses of one recording: half an hour of motion.
const MOST_NOTED: usize = 60_000;

/// What becomes of the camera by itself, and what is noted of it.
#[derive(Default)]
pub(super) struct Flight {
    recording: Option<Vec<(f64, Pose)>>,
    path: Option<CameraPath>,
    /// When it began.
    playing: Option<Duration>,
}

impl Flight {
    /// Returns true if the camera is moved by a path.
    pub(super) fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    pub(super) fn is_recording(&self) -> bool {
        self.recording.is_some()
    }

    /// The camera is there at a time since the program began.
    pub(super) fn note(&mut self, now: Duration, pose: Pose) {
        let Some(noted) = &mut self.recording else { return };
        let time = now.as_secs_f64();
        match noted.last().copied() {
            Some((_, last)) if last == pose => {}
            Some((before, _)) if time - before < STEP.as_secs_f64() => {}
            // A window at rest draws no frames: the camera stood there until now.
            Some((before, last)) if time - before > 3.0 * STEP.as_secs_f64() => {
                noted.extend([(time - STEP.as_secs_f64(), last), (time, pose)]);
            }
            _ => noted.push((time, pose)),
        }
        noted.truncate(MOST_NOTED);
    }

    /// Begins to note where the camera is.
    pub(super) fn begin_recording(&mut self, now: Duration, pose: Pose) {
        self.playing = None;
        self.recording = Some(vec![(now.as_secs_f64(), pose)]);
    }

    /// Ends that, and writes the path over an image of so many texels into a file of a directory, named after
    /// the image's. Says which; `None` if nothing was recorded.
    pub(super) fn end_recording(
        &mut self,
        (now, pose): (Duration, Pose),
        (directory, of): (&Path, &Path),
        image: [u32; 2],
    ) -> Result<Option<PathBuf>> {
        self.note(now, pose);
        let Some(mut noted) = self.recording.take() else { return Ok(None) };
        // It ends where the camera is, when it was there last.
        match noted.last().copied() {
            Some((time, last)) if last != pose || now.as_secs_f64() - time > STEP.as_secs_f64() => {
                noted.push((now.as_secs_f64(), pose));
            }
            _ => {}
        }
        let Some(path) = CameraPath::recorded(RATE, &noted) else { return Ok(None) };
        let file = free_name(directory, of, "path");
        Output::at(&file)?.write(path.to_text(image).as_bytes())?;
        self.path = Some(path);
        Ok(Some(file))
    }

    /// Reads a path over an image of so many texels, to be played.
    pub(super) fn read(&mut self, file: &Path, image: [u32; 2]) -> Result<()> {
        let read = || -> Result<CameraPath> {
            let text = String::from_utf8(crate::commands::replay::read_bytes(file)?);
            Ok(CameraPath::from_text(&text.context("it is no text")?, image)?)
        };
        self.path = Some(read().with_context(|| file.display().to_string())?);
        Ok(())
    }

    /// Begins to play the path that was recorded or read last. Gives back where it begins, if there is one.
    pub(super) fn play(&mut self, now: Duration) -> Option<Pose> {
        let first = self.path.as_ref()?.pose(0.0);
        self.playing = Some(now);
        Some(first)
    }

    /// The camera is moved by somebody else.
    pub(super) fn stop(&mut self) {
        self.playing = None;
    }

    /// Where the path has the camera at a time, while it is played. It stops at its end.
    pub(super) fn pose(&mut self, now: Duration) -> Option<Pose> {
        let (path, begun) = (self.path.as_ref()?, self.playing?);
        let time = now.saturating_sub(begun).as_secs_f64();
        if time >= path.seconds() {
            self.playing = None;
        }
        Some(path.pose(time))
    }
}

/// The name of a file that is not there yet in a directory, or, where nothing can be written there, in the
/// one for temporary files: `earth-1.png` of an `earth.jpg`.
pub(super) fn free_name(directory: &Path, of: &Path, ending: &str) -> PathBuf {
    let stem = of.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
    // Sources that are no files have names that files may not have.
    let stem = if stem.is_empty() { "vastex".to_owned() } else { stem.replace([':', '/', '\\'], "-") };
    let in_directory = |directory: &Path| {
        let named = |number: u32| directory.join(format!("{stem}-{number}.{ending}"));
        (1..u32::MAX).map(named).find(|file| !file.exists())
    };
    let there = in_directory(directory).filter(|file| Output::at(file).is_ok());
    there.or_else(|| in_directory(&std::env::temp_dir())).unwrap_or_else(|| format!("{stem}.{ending}").into())
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
        let directory = tempfile::tempdir().unwrap();
        let of = directory.path().join("moon.tif");
        let seconds = Duration::from_secs_f64;
        let mut flight = Flight::default();
        assert_eq!(flight.play(seconds(0.0)), None);
        flight.begin_recording(seconds(10.0), at(0.1));
        (1..=60)
            .for_each(|n| flight.note(seconds(10.0 + f64::from(n) / 60.0), at(0.1 + 0.005 * f64::from(n))));
        // A rest of two seconds without a frame, then a jump.
        flight.note(seconds(13.0), at(0.8));
        let end = (seconds(14.0), at(0.8));
        let place = (directory.path(), &*of);
        let file = flight.end_recording(end, place, [1000, 500]).unwrap().unwrap();
        assert_eq!(file, directory.path().join("moon-1.path"));
        assert_eq!(
            free_name(directory.path(), Path::new("a/moon.jpg"), "path"),
            directory.path().join("moon-2.path")
        );
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.starts_with("vastex path 1\n") && text.lines().count() < 17, "{text}");
        assert!(!flight.is_recording());
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
        let written = directory.path().join("a.path");
        std::fs::write(&written, &text).unwrap();
        let mut again = Flight::default();
        again.read(&written, [1000, 500]).unwrap();
        assert!((x(again.play(seconds(0.0))) - 0.1).abs() < 1e-12);
        std::fs::write(&written, "vastex path 1\nsoon").unwrap();
        let error = format!("{:#}", again.read(&written, [1000, 500]).unwrap_err());
        assert!(error.contains("a.path: line 2: 'soon' is no time"), "{error}");
    }
}
