//! A volume that moves by itself in a window: what a person moves is noted, and paths are played.

use std::time::Duration;

use super::{VolumePlace, VolumeViewError, VolumeViewText};
use crate::camera::{CameraPath, Flight, LeftOut, Recorded, WhyLeftOut};
use crate::volume::VolumeBox;
use crate::volume_scene::VolumeScene;

/// What leads the camera, the slices and the time of a volume, and notes where a person takes them.
///
/// A host calls [`VolumeFlight::lead`] before each frame of the scene, with a clock of its own.
#[derive(Debug, Default)]
pub struct VolumeFlight {
    flight: Flight<VolumePlace>,
    /// Where the scene was left at the last call: where it is elsewhere, a person has moved it.
    led: Option<VolumePlace>,
    /// The box of the volume that is led.
    of: Option<VolumeBox>,
    /// That of the volume that is noted.
    noted: Option<VolumeBox>,
    /// True if another one came while it was.
    is_left: bool,
}

impl VolumeFlight {
    /// Returns true if a path leads the volume: then frames are due by themselves.
    pub fn is_playing(&self) -> bool {
        self.flight.is_playing()
    }

    /// Returns true if it is noted where a person takes the volume.
    pub fn is_recording(&self) -> bool {
        self.flight.is_recording()
    }

    /// Begins to note where a person takes the volume.
    pub fn begin_recording(&mut self, now: Duration, scene: &VolumeScene) {
        (self.noted, self.is_left) = (Some(scene.facts().of), false);
        self.flight.begin_recording(now, VolumePlace::seen(&scene.look, scene.facts()));
    }

    /// Ends that, where the volume is now, or where it was noted last if nothing, or another volume, is shown
    /// by now. The path can be played from now on. Returns `None` if nothing was recorded.
    pub fn end_recording(
        &mut self,
        now: Duration,
        scene: Option<&VolumeScene>,
    ) -> Option<Recorded<'_, VolumePlace>> {
        let of = self.noted.take()?;
        let is_left = self.is_left || scene.is_none_or(|scene| scene.facts().of != of);
        let scene = scene.filter(|_| !is_left);
        let place = scene.map(|scene| VolumePlace::seen(&scene.look, scene.facts()));
        let recorded =
            |rate: f64, seen: &[(f64, VolumePlace)]| CameraPath::recorded_of_volume(rate, seen, &of);
        let Recorded { path, left_out } = self.flight.end_recording_with((now, place), recorded)?;
        let of_another = LeftOut { after: path.seconds(), why: WhyLeftOut::Another };
        Some(Recorded { path, left_out: left_out.or(is_left.then_some(of_another)) })
    }

    /// From now on this is the path to be played.
    pub fn set_path(&mut self, path: CameraPath<VolumePlace>) {
        self.flight.set_path(path);
    }

    /// Begins to play the path that was recorded or set last. Returns false if there is none. Fails, and
    /// changes nothing, if the volume does not have a time of it.
    pub fn play(&mut self, now: Duration, scene: &mut VolumeScene) -> Result<bool, VolumeViewError> {
        let Some(path) = self.flight.path() else { return Ok(false) };
        // A path never goes beyond its places.
        let latest = path.keys().iter().map(|(_, place)| *place).max_by_key(|place| place.time);
        if let Some(latest) = latest {
            latest.of(&VolumeViewText::default()).change(&mut scene.look.clone(), scene.facts())?;
        }
        let first = self.flight.play(now);
        if first.is_some_and(|place| place.time.is_some()) {
            scene.play(false);
        }
        (self.led, self.of) = (None, Some(scene.facts().of));
        Ok(true)
    }

    /// The volume stays where it is.
    pub fn stop(&mut self) {
        self.flight.stop();
    }

    /// Moves the volume to where the path has it, unless a person has moved it since the last call: then the
    /// path ends. Takes note of where it is, if that is recorded. A time that has yet to be read is waited
    /// for, while camera and slices go on.
    pub fn lead(&mut self, now: Duration, scene: &mut VolumeScene) {
        if !self.is_playing() && !self.is_recording() {
            return;
        }
        self.leave_others(scene);
        let seen = VolumePlace::seen(&scene.look, scene.facts());
        if self.led.take().is_some_and(|led| seen.parts_of(&led) != led) {
            self.stop();
        }
        if let Some(mut place) = self.flight.pose(now) {
            let is_coming = scene.seen_time() != scene.look.time;
            if is_coming && self.is_playing() {
                place.time = place.time.map(|_| scene.look.time);
            }
            let facts = scene.facts().clone();
            // The volume has what the path names: that was found out when it began.
            drop(place.of(&VolumeViewText::default()).change(&mut scene.look, &facts));
            let led = VolumePlace::seen(&scene.look, &facts).parts_of(&place);
            self.led = self.is_playing().then_some(led);
        }
        if self.is_recording() && !self.is_left {
            self.flight.note(now, VolumePlace::seen(&scene.look, scene.facts()));
        }
    }

    /// The path of another volume ends, and so does what is noted of one.
    fn leave_others(&mut self, scene: &VolumeScene) {
        let of = Some(scene.facts().of);
        if self.of != of {
            self.flight.stop();
        }
        self.is_left |= self.noted != of;
    }
}
