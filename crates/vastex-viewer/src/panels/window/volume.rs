//! The panel in the window while a volume is shown: files as for images, and the volume's own settings.

use std::ffi::OsString;

use egui::{Align2, Area, Id, RichText, ScrollArea, Ui, Vec2};

use super::super::{Bookmark, BookmarksChange, VolumeChange, VolumePanel, VolumeStatus};
use super::room::PANEL_WIDTH;
use super::{WindowAsked, WindowPanel, images_of_file, theme};
use crate::input::{FILES, WINDOW};
use crate::volume_scene::{VOLUME_CONTROLS, VolumeLook};

/// Keys and gestures while a volume is shown.
const KEYS: &[(&str, &[(&str, &str)])] = &[VOLUME_CONTROLS[0], FILES, WINDOW];

/// What a window's panel is told of a volume, for one frame.
pub struct WindowOfVolume<'a> {
    /// Name of the volume.
    pub name: &'a str,
    /// What the volume's own part of the panel is told.
    pub told: VolumeStatus<'a>,
    /// What the volume says of itself: a name and a value each.
    pub rows: &'a [(String, String)],
    /// What else the volume's file can be opened as, each with its path.
    pub images: &'a [(String, OsString)],
    /// Paths of files that were opened lately, the last one first.
    pub recent: &'a [String],
    /// Views of the volume that a person keeps, the oldest first.
    pub bookmarks: &'a [Bookmark],
}

impl WindowPanel {
    /// Shows everything beside a volume. Gives back what is asked for, and what of the volume.
    pub fn show_volume(
        &mut self,
        ui: &mut Ui,
        (own, look): (&mut VolumePanel, &mut VolumeLook),
        shown: &WindowOfVolume<'_>,
    ) -> (Vec<WindowAsked>, Vec<VolumeChange>) {
        let (mut asked, mut changes) = (Vec::new(), Vec::new());
        if self.is_seen() {
            let panel = egui::Panel::right("panel").resizable(false).exact_size(PANEL_WIDTH);
            panel.show(ui, |ui| {
                ui.add_space(4.0);
                ui.horizontal(|ui| {
                    ui.add(egui::Label::new(RichText::new(shown.name).strong()).truncate());
                });
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    self.files(ui, shown.recent, false, &mut asked);
                    self.images.show(ui, &mut asked);
                    images_of_file(ui, shown.images, &mut asked);
                    self.info.show(ui, shown.rows);
                    ui.separator();
                    changes = own.show(ui, look, &shown.told);
                    ui.separator();
                    match self.views.show(ui, shown.bookmarks) {
                        Some(BookmarksChange::Keep(name)) => asked.push(WindowAsked::Keep(name)),
                        Some(BookmarksChange::Copy) => asked.push(WindowAsked::CopyView),
                        Some(BookmarksChange::CopyLink) => asked.push(WindowAsked::CopyLink),
                        Some(BookmarksChange::Show(view)) => asked.push(WindowAsked::ShowText(view)),
                        Some(BookmarksChange::Forget(index)) => asked.push(WindowAsked::Forget(index)),
                        None => {}
                    }
                    ui.separator();
                    ui.checkbox(&mut self.guides_are_shown, "Guides")
                        .on_hover_text("crosshair, box, scale and axes: G");
                    ui.checkbox(&mut self.values_are_shown, "Value below the pointer")
                        .on_hover_text("a line at the foot of the picture: J");
                    theme(ui);
                });
            });
        }
        if !self.is_seen() {
            let corner = Area::new(Id::unique("corner")).anchor(Align2::RIGHT_TOP, Vec2::new(-8.0, 8.0));
            corner.show(ui.ctx(), |ui| {
                if ui.button("Panel").on_hover_text("files, channels and modes: M; keys: ?").clicked() {
                    self.open();
                }
            });
        }
        self.keys(ui.ctx(), KEYS);
        (asked, changes)
    }
}
