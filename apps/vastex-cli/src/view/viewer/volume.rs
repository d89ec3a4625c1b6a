//! A volume in the window: what its scene asks for is read by threads ([`VolumeWork`]), and handed to it.

use std::sync::Arc;

use anyhow::{Error, Result, anyhow};
use vastex::Settings;
use vastex_viewer::beside::{Beside, VOLUME};
use vastex_viewer::volume_scene::{VolumeAsked, VolumeLook};
use vastex_viewer::window_scene::{ShownVolume, VolumeToShow};

use super::super::is_device_lost;
use super::super::opening::SaidOfVolume;
use super::super::volume_work::{Done, VolumeWork};
use super::{OpenVolume, Viewer};
use crate::report;
use crate::screenshot::VolumeShot;
use crate::volumes::OpenedVolume;

impl Viewer {
    /// Shows a volume in the place of what is displayed.
    pub(in super::super) fn show_volume(
        &mut self,
        opening: u64,
        (name, opened, look): (&str, OpenedVolume, VolumeLook),
        (rows, images): SaidOfVolume,
        settings: Settings,
    ) -> Result<()> {
        let (name_of, facts) = (name.to_owned(), opened.facts.clone());
        let shown = VolumeToShow { name: name_of, facts, look, settings, rows, images };
        let on = (self.scene.gpu(), &self.scene.beside);
        let shown = ShownVolume::new(on, shown, (self.surface.formats(), self.surface.size()))?;
        let window = self.window.clone();
        let work = VolumeWork::new(opened, Arc::new(move || window.request_redraw()));
        self.scene.give_way(opening, name);
        self.volume = Some(Box::new(OpenVolume { shown, work }));
        Ok(())
    }

    /// Hands a volume what threads have read for it since the last frame.
    pub(super) fn bring_to_volume(&mut self) {
        let Some(OpenVolume { shown: volume, work }) = self.volume.as_deref_mut() else { return };
        work.want_levels(volume.scene.textures(), volume.scene.has_all());
        volume.scene.expect_changes(work.has_early_bricks());
        let (all, changes) = (work.take_done(), work.changes());
        if !all.is_empty() || !changes.is_empty() {
            volume.refresh();
        }
        volume.scene.changed(&changes);
        let brought = all.into_iter().filter_map(|done| bring(volume, work, done).err());
        let mut errors: Vec<Error> = brought.collect();
        let textures = volume.scene.textures();
        let (times, seen) = (volume.scene.times_kept(), volume.scene.seen_time());
        work.keep(&times, seen, |texture| textures.texture(texture).is_ok());
        errors.extend(work.take_faults().into_iter().map(Error::new));
        volume.set_being_made(work.is_making());
        errors.iter().for_each(|error| say(&mut self.scene.beside, error));
    }

    /// Has threads begin what a volume asks for.
    pub(super) fn read_for_volume(&mut self) {
        let Some(OpenVolume { shown: volume, work }) = self.volume.as_deref_mut() else { return };
        for asked in volume.scene.take_asked() {
            let begun = match &asked {
                &VolumeAsked::Channel { channel, time } => {
                    work.read((channel, time), volume.scene.preparer())
                }
                &VolumeAsked::Labels { nth, time } => work.read_labels((nth, time), volume.scene.preparer()),
                VolumeAsked::Point(asked) => work.ask(*asked, &volume.scene.look),
                VolumeAsked::Ranges(channels) => work.find_ranges(channels, volume.scene.seen_time()),
                &VolumeAsked::Label { label, nth, time } => work.find_label(label, (nth, time)),
            };
            let Err(error) = begun else { continue };
            // Nobody waits for what is not read.
            match asked {
                VolumeAsked::Channel { channel, time } => volume.scene.refuse(channel, time),
                VolumeAsked::Labels { nth, time } => volume.scene.refuse_labels(nth, time),
                VolumeAsked::Point(asked) => volume.scene.report_nothing(asked.number),
                VolumeAsked::Ranges(_) | VolumeAsked::Label { .. } => {}
            }
            say(&mut self.scene.beside, &error);
        }
    }

    /// What a picture shows of the volume, so many times as large as the window; `None` without one.
    pub(in super::super) fn volume_shot(&self, times: u32) -> Option<VolumeShot> {
        let OpenVolume { shown: volume, work } = self.volume.as_deref()?;
        Some(VolumeShot {
            source: work.path().to_owned(),
            look: Some(volume.scene.look.clone()),
            size: self.surface.size().map(|side| side.saturating_mul(times)),
            pixels_per_point: self.window.scale_factor() as f32 * times as f32,
            has_guides: self.scene.beside.panel().guides_are_shown(),
            has_hud: self.scene.beside.hud_is_shown(),
        })
    }
}

/// Says what went wrong with a volume, in the window and outside.
fn say(beside: &mut Beside, error: &Error) {
    let said = report::message(error);
    beside.show_error(VOLUME, &said);
    beside.log(said);
}

/// Returns true if what was read cannot be taken since its device is not the one of the window any more: that
/// was lost, or another with other settings has taken its place meanwhile.
fn is_of_other_device(error: &Error) -> bool {
    is_device_lost(error) || matches!(error.downcast_ref(), Some(vastex::Error::OtherSettings))
}

/// Hands a volume what a thread has read. What was read for another device is asked for again, for the one
/// that has taken its place.
fn bring(volume: &mut ShownVolume, work: &mut VolumeWork, done: Done) -> Result<()> {
    let asked = match done {
        Done::Channel { channel, time, .. } => Some(VolumeAsked::Channel { channel, time }),
        Done::Labels { nth, time, .. } => Some(VolumeAsked::Labels { nth, time }),
        _ => None,
    };
    match (bring_once(volume, work, done), asked) {
        (Err(error), Some(asked)) if is_of_other_device(&error) => {
            volume.scene.ask_again(&asked);
            Ok(())
        }
        (brought, _) => brought,
    }
}

/// Hands a volume what a thread has read, and has the levels made that it lacks.
fn bring_once(volume: &mut ShownVolume, work: &mut VolumeWork, done: Done) -> Result<()> {
    let scene = &mut volume.scene;
    match done {
        Done::Channel { channel, time, read: Ok(read) } => {
            match scene.add((channel, time), read.prepared, read.usual)? {
                Some(texture) => work.make_levels(texture, read.source),
                None => Ok(()),
            }
        }
        Done::Channel { channel, time, read: Err(error) } => {
            scene.refuse(channel, time);
            Err(error)
        }
        Done::Labels { nth, time, read: Ok(read) } => {
            match scene.add_labels((nth, time), read.prepared, read.place)? {
                Some(texture) => work.make_levels(texture, read.source),
                None => Ok(()),
            }
        }
        Done::Labels { nth, time, read: Err(error) } => {
            scene.refuse_labels(nth, time);
            Err(error)
        }
        Done::Point(Ok(told), _) => {
            volume.report(told);
            Ok(())
        }
        Done::Point(Err(error), number) => {
            scene.report_nothing(number);
            Err(error)
        }
        Done::Values { channel, values } => {
            volume.set_values(channel, values?);
            Ok(())
        }
        Done::Label { label, nth, found } => match scene.show_label(nth, found?) {
            true => Ok(()),
            false => Err(anyhow!("{}: has no label {label}", volume.name())),
        },
        Done::Range { channel, range } => {
            scene.set_range(channel, range?);
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_for_another_device_is_told_from_what_cannot_be_read() {
        assert!(is_of_other_device(&vastex::Error::OtherSettings.into()));
        assert!(is_of_other_device(&vastex::Error::Gpu(vastex::GpuError::DeviceLost).into()));
        assert!(!is_of_other_device(&vastex::Error::TailPending.into()));
        assert!(!is_of_other_device(&anyhow!("it has no such channel")));
    }
}
