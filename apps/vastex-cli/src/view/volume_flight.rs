//! Camera paths of a volume in the window: recorded by F8, played by F9 and from files.

use std::path::Path;

use vastex_viewer::CameraPath;

use super::outgoing::{NO_PATH, RECORDING};
use super::{App, flight};
use crate::report;

impl App {
    /// Returns true if a volume is shown.
    pub(super) fn shows_volume(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.viewer.shows_volume())
    }

    /// Notes where the volume is taken from here on.
    pub(super) fn record_volume(&mut self) {
        let now = self.begun.elapsed();
        let Some(volume) = self.open.as_mut().and_then(|open| open.viewer.volume()) else { return };
        self.volume_flight.begin_recording(now, &volume.scene);
        self.volume_recorded_of = self.shown_path().to_owned();
        self.notify(RECORDING);
    }

    /// Ends what is noted of a volume, and writes it down.
    pub(super) fn end_recording_of_volume(&mut self) {
        if !self.volume_flight.is_recording() {
            return;
        }
        let now = self.begun.elapsed();
        let volume = self.open.as_mut().and_then(|open| open.viewer.volume());
        let recorded = self.volume_flight.end_recording(now, volume.map(|volume| &volume.scene));
        let recorded = recorded.map(|recorded| (recorded.path.volume_text(), recorded.left_out));
        let of = std::mem::take(&mut self.volume_recorded_of);
        self.write_path(recorded, &of);
    }

    /// Plays the path of a volume that was recorded or read last.
    pub(super) fn play_in_volume(&mut self) {
        let now = self.begun.elapsed();
        let Some(open) = &mut self.open else { return };
        let Some(volume) = open.viewer.volume() else { return };
        match self.volume_flight.play(now, &mut volume.scene) {
            Ok(true) => open.window.request_redraw(),
            Ok(false) => self.notify(NO_PATH),
            Err(error) => self.report_error("camera path", &report::message(&error.into())),
        }
    }

    /// Plays the path of a file round a volume.
    pub(super) fn play_file_in_volume(&mut self, file: &Path) {
        match flight::read_path(file, CameraPath::of_volume) {
            Ok(path) => {
                self.volume_flight.set_path(path);
                self.play_in_volume();
            }
            Err(error) => self.report_error("camera path", &report::message(&error)),
        }
    }

    /// Has the path move the volume, if one is played, before a frame of it.
    pub(super) fn lead_volume(&mut self) {
        let now = self.begun.elapsed();
        if let Some(volume) = self.open.as_mut().and_then(|open| open.viewer.volume()) {
            volume.lead(now, &mut self.volume_flight);
        }
    }
}
