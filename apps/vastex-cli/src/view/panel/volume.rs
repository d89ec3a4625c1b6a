//! The panel in the window while a volume is shown: files as for images, and the volume's own settings.

use egui::{Align2, Area, Id, RichText, ScrollArea, Ui, Vec2};
use vastex_viewer::panels::{BookmarksChange, VolumeChange, VolumePanel, VolumeStatus, keys_window_of};
use vastex_viewer::volume_scene::{VOLUME_CONTROLS, VolumeLook};

use super::room::PANEL_WIDTH;
use super::{Asked, Panel, theme};

/// What the panel is told of a volume.
pub(in super::super) struct StatusOfVolume<'a> {
    pub(in super::super) name: &'a str,
    pub(in super::super) told: VolumeStatus<'a>,
    /// What `vastex info` says of it.
    pub(in super::super) rows: &'a [(String, String)],
}

/// What a person asks for, of files and of the volume.
pub(in super::super) struct AskedOfVolume {
    pub(in super::super) asked: Vec<Asked>,
    pub(in super::super) changes: Vec<VolumeChange>,
}

impl Panel {
    /// Shows everything beside a volume.
    pub(in super::super) fn show_volume(
        &mut self,
        ui: &mut Ui,
        (own, look): (&mut VolumePanel, &mut VolumeLook),
        shown: &StatusOfVolume<'_>,
    ) -> AskedOfVolume {
        let (mut asked, mut changes) = (Vec::new(), Vec::new());
        if self.is_seen() {
            let panel = egui::Panel::right("panel").resizable(false).exact_size(PANEL_WIDTH);
            panel.show(ui, |ui| {
                ui.add_space(4.0);
                ui.horizontal(|ui| {
                    ui.add(egui::Label::new(RichText::new(shown.name).strong()).truncate());
                });
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    self.files(ui, false, &mut asked);
                    self.info.show(ui, shown.rows);
                    ui.separator();
                    changes = own.show(ui, look, &shown.told);
                    ui.separator();
                    match self.views.show(ui, self.bookmarks.views()) {
                        Some(BookmarksChange::Keep(name)) => asked.push(Asked::Keep(name)),
                        Some(BookmarksChange::Copy) => asked.push(Asked::CopyView),
                        Some(BookmarksChange::CopyLink) => asked.push(Asked::CopyLink),
                        Some(BookmarksChange::Show(view)) => asked.push(Asked::ShowText(view)),
                        Some(BookmarksChange::Forget(index)) => self.bookmarks.forget(index),
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
        keys_window_of(ui.ctx(), &mut self.keys_are_shown, VOLUME_CONTROLS);
        AskedOfVolume { asked, changes }
    }
}
