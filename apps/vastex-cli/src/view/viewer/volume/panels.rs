//! The panels over a volume in the window, and what a person changes in them.

use egui::Rect;
use vastex_viewer::hud::{HudChange, HudData};
use vastex_viewer::panels::{
    VolumeChange, VolumePanes, VolumeStatus, WindowOfVolume, say_below, status_line, volume_status_text,
};

use super::super::Viewer;
use super::VolumeShown;
use crate::report;

impl Viewer {
    pub(super) fn run_panels_of_volume(&mut self, volume: &mut VolumeShown) {
        let now = self.scene.beside.now();
        self.scene.beside.title.expire(now);
        let hud_data = self.scene.beside.hud.is_shown().then(|| HudData {
            frames: self.scene.beside.hud.frames.clone(),
            ..HudData::of(volume.scene.textures())
        });
        let (share, stats) = volume.scene.share_at_wanted();
        let facts = volume.scene.facts().clone();
        let clicked = volume.scene.points().clicked().cloned();
        let below = volume.scene.points().below().map(|told| volume_status_text(&facts, told));
        let below = below.filter(|_| self.scene.beside.panel.values_are_shown());
        let told = VolumeStatus {
            facts: &facts,
            seen_time: volume.scene.seen_time(),
            is_playing: volume.scene.is_playing(),
            share,
            missing: stats.missing,
            bias: f64::from(stats.bias_eighths) / 8.0,
            clicked: clicked.as_ref(),
            values: &volume.values,
        };
        let (recent, bookmarks) = (self.recent.files(), self.bookmarks.views());
        let shown = WindowOfVolume { name: &volume.name, told, rows: &volume.rows, recent, bookmarks };
        let (panes, names, own) = (volume.scene.panes(), &volume.names, &mut volume.panel);
        let mut look = volume.scene.look.clone();
        let beside = &mut self.scene.beside;
        let notice = beside.title.notice().map(str::to_owned);
        beside.shown_notice = notice.clone();
        let opening = beside.opening.clone();
        let (panel, messages, hud) = (&mut beside.panel, &mut beside.messages, &mut beside.hud.panel);
        let (mut asked, mut hud_changes, mut all, mut scale) = (Vec::new(), Vec::new(), Rect::NOTHING, 1.0);
        let mut changes = Vec::new();
        self.shell.run(|ui| {
            let has_room = panel.leaves_room_beside(ui, hud_data.is_some());
            if let Some(data) = hud_data.as_ref().filter(|_| has_room) {
                hud_changes = hud.show(ui, data);
            }
            let (asks, changed) = panel.show_volume(ui, (own, &mut look), &shown);
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
            say_below(
                ui,
                (notice.as_deref(), opening.as_ref().map(|(name, share)| (&**name, *share))),
                below.as_deref().map_or(0.0, |text| status_line(ui.ctx(), all, text)),
            );
            messages.show(ui.ctx(), all);
        });
        self.scene.beside.asked.extend(asked);
        let pixel = |points: f32| (points * scale).round().max(0.0);
        let corner = [f64::from(pixel(all.left())), f64::from(pixel(all.top()))];
        let area = (corner, [pixel(all.width()) as u32, pixel(all.height()) as u32].map(|side| side.max(1)));
        volume.is_stale |= area != volume.area || look != volume.scene.look;
        (volume.area, volume.scene.look) = (area, look);
        for change in changes {
            volume.is_stale = true;
            match change {
                VolumeChange::UsualRanges(channels) => {
                    let seen = volume.scene.seen_time();
                    if let Err(error) = volume.work.find_ranges(&channels, seen) {
                        self.scene.beside.messages.add("volume", report::message(&error));
                    }
                }
                VolumeChange::Play(plays) => volume.scene.play(plays),
                VolumeChange::Fit => volume.scene.look.fit(&facts),
                VolumeChange::FindLabel(label) => {
                    let nth = volume.scene.look.labels.shown.unwrap_or(0);
                    let found = volume.work.find_label(label, (nth, volume.scene.seen_time()));
                    if let Err(error) = found {
                        self.scene.beside.messages.add("volume", report::message(&error));
                    }
                }
            }
        }
        for change in &hud_changes {
            self.change_of_volume(volume, change);
        }
    }

    /// Changes what a person changed of what the machine does.
    fn change_of_volume(&mut self, volume: &mut VolumeShown, change: &HudChange) {
        let textures = volume.scene.textures_mut();
        let changed = match *change {
            HudChange::PoolBytes(pool, Some(bytes)) => textures.memory().resize_pool(pool, bytes).map(drop),
            HudChange::PoolBytes(pool, None) => textures.memory().fit_pool(pool).map(drop),
            HudChange::Rule(pool, rule) => textures.memory().set_bias_rule(pool, rule),
            HudChange::Budgets { uploads, in_flight } => {
                self.scene.chosen().set_budgets(textures, [uploads, in_flight]);
                Ok(())
            }
            HudChange::Filter(_) | HudChange::Overlay(_) | HudChange::Feedback(_) => {
                self.scene.beside.notify("volumes are sampled and asked in one way");
                Ok(())
            }
        };
        volume.is_stale = true;
        match changed {
            Ok(()) => drop(self.scene.beside.messages.forget("change")),
            Err(error) => self.scene.beside.tell("change", &error.to_string()),
        }
    }
}
