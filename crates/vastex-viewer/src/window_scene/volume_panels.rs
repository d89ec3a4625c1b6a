//! The panels beside a volume and what lies over its pictures, and what becomes of what a person changes in
//! them.

use egui::{Rect, Ui};

use super::volume::ShownVolume;
use crate::beside::Beside;
use crate::hud::HudData;
use crate::panels::{
    Bookmark, VolumeChange, VolumePanes, VolumeStatus, WindowOfVolume, say_below, status_line,
    volume_status_text,
};

impl ShownVolume {
    /// Shows the panel and the pictures with what lies over them, and shows of the volume what was changed.
    pub(super) fn show_panels(
        &mut self,
        beside: &mut Beside,
        (recent, bookmarks): (&[String], &[Bookmark]),
        run: impl FnOnce(&mut dyn FnMut(&mut Ui)),
    ) {
        let now = beside.now();
        beside.title.expire(now);
        let hud_data = beside.hud.is_shown().then(|| HudData {
            frames: beside.hud.frames.clone(),
            is_of_volume: true,
            ..HudData::of(self.scene.textures())
        });
        let (share, stats) = self.scene.share_at_wanted();
        let facts = self.scene.facts().clone();
        let clicked = self.scene.points().clicked().cloned();
        let below = self.scene.points().below().map(|told| volume_status_text(&facts, told));
        let below = below.filter(|_| beside.panel.values_are_shown());
        let told = VolumeStatus {
            facts: &facts,
            seen_time: self.scene.seen_time(),
            is_playing: self.scene.is_playing(),
            share,
            missing: stats.missing,
            bias: f64::from(stats.bias_eighths) / 8.0,
            cut: self.scene.ray_cut(),
            clicked: clicked.as_ref(),
            values: &self.values,
        };
        let (name, images) = (&*self.name, &*self.images);
        let shown = WindowOfVolume { name, told, rows: &self.rows, images, recent, bookmarks };
        let (panes, names, own) = (self.scene.panes(), &self.names, &mut self.panel);
        let mut look = self.scene.look.clone();
        beside.shown_notice = beside.title.notice().map(str::to_owned);
        let (notice, opening) = (beside.title.notice(), beside.opening.as_ref());
        let opening = opening.map(|(name, share)| (&**name, *share));
        let (panel, messages, hud) = (&mut beside.panel, &mut beside.messages, &mut beside.hud.panel);
        let (mut asked, mut hud_changes, mut all, mut scale) = (Vec::new(), Vec::new(), Rect::NOTHING, 1.0);
        let mut changes = Vec::new();
        run(&mut |ui| {
            let has_room = panel.leaves_room_beside(ui, hud_data.is_some());
            if let Some(data) = hud_data.as_ref().filter(|_| has_room) {
                hud_changes = hud.show(ui, data);
            }
            let (asks, changed) = panel.show_volume(ui, (&mut *own, &mut look), &shown);
            asked.extend(asks);
            changes.extend(changed);
            (all, scale) = (ui.available_rect_before_wrap(), ui.pixels_per_point());
            let shown = VolumePanes {
                facts: &facts,
                look: &look,
                panes: &panes,
                pictures: names,
                has_guides: panel.guides_are_shown(),
                seen_time: told.seen_time,
            };
            shown.paint(ui.painter(), all, scale);
            // Slices have one scale bar.
            let line = below.as_deref().map_or(0.0, |text| status_line(ui.ctx(), (all, 1), text));
            say_below(ui, (notice, opening), line);
            messages.show(ui.ctx(), all);
        });
        beside.asked.extend(asked);
        let pixel = |points: f32| (points * scale).round().max(0.0);
        let corner = [f64::from(pixel(all.left())), f64::from(pixel(all.top()))];
        let area = (corner, [pixel(all.width()) as u32, pixel(all.height()) as u32].map(|side| side.max(1)));
        self.is_stale |= area != self.area || look != self.scene.look || !changes.is_empty();
        (self.area, self.scene.look) = (area, look);
        for change in changes {
            match change {
                VolumeChange::UsualRanges(channels) => self.scene.ask_ranges(channels),
                VolumeChange::Play(plays) => self.scene.play(plays),
                VolumeChange::Fit => self.scene.look.fit(&facts),
                VolumeChange::FindLabel(label) => self.scene.ask_label(label),
            }
        }
        hud_changes.iter().for_each(|change| self.change(beside, change));
    }
}
