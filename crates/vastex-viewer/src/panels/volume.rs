//! What a person changes of a volume: channels, modes, times, what is cut away.

use egui::{
    Button, CollapsingHeader, Color32, DragValue, Response, RichText, Slider, TextEdit, Ui, WidgetInfo,
};

use super::palettes::palette_controls;
use super::volume_histogram::{VolumeValues, volume_histogram};
use super::volume_words::{LONGEST_STEP, dimmer_text, place_text, point_rows, ray_cut_text};
use crate::layers::Palette;
use crate::volume::{MOST_END, OtherLabels, RayCut, VolumeBox, VolumeMode, least_apart, parse_label};
use crate::volume_scene::{
    ChannelLook, ClipLook, PointAnswer, VolumeFacts, VolumeLayout, VolumeLook, VolumePane,
};

/// Names of axes.
const AXES: [&str; 3] = ["x", "y", "z"];
/// What the modes show.
const MODES: [&str; 5] = [
    "the largest value along each ray",
    "the smallest value along each ray",
    "the mean of the values along each ray",
    "what glows, and hides what is behind it",
    "the surface at which a value is reached",
];

/// Something that a person asks for and that is the host's to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VolumeChange {
    /// The usual ranges of these channels.
    UsualRanges(Vec<usize>),
    /// Times are to be played, or not any more.
    Play(bool),
    /// Show the whole volume, as at first.
    Fit,
    /// The crosshair in a label of this number, wherever that is.
    FindLabel(i128),
}

/// What the panel is told.
#[derive(Clone, Copy, Debug)]
pub struct VolumeStatus<'a> {
    /// What is known of the volume.
    pub facts: &'a VolumeFacts,
    /// The time that is seen.
    pub seen_time: u64,
    /// True if times are played.
    pub is_playing: bool,
    /// What of all pixels is at its wanted level, 0 to 1.
    pub share: f64,
    /// Bricks that are missing, and levels that all are coarser so that they fit.
    pub missing: u32,
    /// See [`VolumeStatus::missing`].
    pub bias: f64,
    /// Of what rays may meet more than is taken.
    pub cut: Option<RayCut>,
    /// What lies where the last click was.
    pub clicked: Option<&'a PointAnswer>,
    /// Of each channel, as far as that is known, which values it has.
    pub values: &'a [Option<VolumeValues>],
}

/// The panel, as a person left it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VolumePanel {
    /// The channel whose settings are shown.
    chosen: usize,
    /// The number that is being written, and what is wrong with it.
    label: Option<String>,
    label_error: Option<String>,
}

impl VolumePanel {
    /// Shows everything, and changes the look in place. Gives back what is asked for beside that.
    pub fn show(&mut self, ui: &mut Ui, look: &mut VolumeLook, told: &VolumeStatus<'_>) -> Vec<VolumeChange> {
        let mut asked = Vec::new();
        layouts(ui, look, &mut asked);
        ui.separator();
        modes(ui, look, told);
        ui.separator();
        self.channels(ui, look, told, &mut asked);
        self.labels(ui, look, told.facts, &mut asked);
        ui.separator();
        times(ui, look, told, &mut asked);
        crosshair(ui, look, told);
        CollapsingHeader::new("Cut away").show(ui, |ui| clip(ui, &mut look.clip));
        ui.separator();
        state(ui, look, told);
        asked
    }

    fn channels(
        &mut self,
        ui: &mut Ui,
        look: &mut VolumeLook,
        told: &VolumeStatus<'_>,
        asked: &mut Vec<VolumeChange>,
    ) {
        if look.channels.is_empty() {
            return;
        }
        ui.label(RichText::new("Channels").strong());
        self.chosen = self.chosen.min(look.channels.len().saturating_sub(1));
        for nth in 0..look.channels.len() {
            let name = told.facts.channel_name(nth);
            let channel = &mut look.channels[nth];
            ui.horizontal(|ui| {
                let shown = ui.checkbox(&mut channel.is_shown, "");
                named(&shown, &format!("show {name}"));
                let color = ui.color_edit_button_srgb(&mut channel.color);
                named(&color, &format!("color of {name}"));
                let name = channel.map.map_or(name.clone(), |map| format!("{name}: {map}"));
                let label = ui.selectable_label(nth == self.chosen, name);
                if label.on_hover_text("its range, gamma and opacity below").clicked() {
                    self.chosen = nth;
                }
            });
        }
        let chosen = self.chosen;
        if let Some(channel) = look.channels.get_mut(chosen) {
            let (bounds, before) = (told.facts.bounds, channel.range);
            ui.horizontal(|ui| {
                ui.label("Range");
                match &mut channel.range {
                    Some(range) => {
                        let speed = ((range[1] - range[0]).abs() / 200.0).max(f64::MIN_POSITIVE);
                        for (value, name) in range.iter_mut().zip(["dark", "bright"]) {
                            let mut drag = DragValue::new(value).speed(speed).max_decimals(4);
                            if let Some([low, high]) = bounds {
                                drag = drag.range(low..=high);
                            }
                            named(&ui.add(drag).on_hover_text(name), name);
                        }
                    }
                    None => drop(ui.label("is being read")),
                }
                if ui.button("Usual").on_hover_text("by its values; of all that are shown: C").clicked() {
                    asked.push(VolumeChange::UsualRanges(vec![chosen]));
                }
            });
            if let Some(mut range) = channel.range {
                match told.values.get(chosen).and_then(Option::as_ref) {
                    Some(values) => drop(volume_histogram(ui, values, channel, &mut range)),
                    None => strip(ui, channel, range[0] > range[1]),
                }
                channel.range = Some(before.map_or(range, |before| kept_apart(range, before)));
            }
            map_controls(ui, &mut channel.map);
            ui.add(Slider::new(&mut channel.gamma, 0.1..=5.0).logarithmic(true).text("Gamma"));
            ui.add(Slider::new(&mut channel.opacity, 0.0..=1.0).text("Opacity"));
        }
    }
}

impl VolumePanel {
    fn labels(
        &mut self,
        ui: &mut Ui,
        look: &mut VolumeLook,
        facts: &VolumeFacts,
        asked: &mut Vec<VolumeChange>,
    ) {
        if facts.labels.is_empty() {
            return;
        }
        ui.separator();
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Labels").strong());
            for (nth, name) in facts.labels.iter().enumerate() {
                let is_shown = look.labels.shown == Some(nth);
                let label = ui.selectable_label(is_shown, format!("labels {name}"));
                if label.on_hover_text("over the channels: L").clicked() {
                    (look.labels.shown, look.labels.selected) = ((!is_shown).then_some(nth), None);
                }
            }
        });
        if look.labels.shown.is_none() {
            return;
        }
        ui.add(Slider::new(&mut look.labels.opacity, 0.0..=1.0).text("Cover"));
        ui.checkbox(&mut look.labels.outlines, "Outlines in slices");
        self.selected_label(ui, look, facts, asked);
    }

    /// The label that is selected: by a click in a picture, or by its number here.
    fn selected_label(
        &mut self,
        ui: &mut Ui,
        look: &mut VolumeLook,
        facts: &VolumeFacts,
        asked: &mut Vec<VolumeChange>,
    ) {
        ui.horizontal(|ui| {
            let name = ui.label("Selected");
            let shown = look.labels.selected.map_or(String::new(), |label| label.to_string());
            let mut text = self.label.clone().unwrap_or(shown);
            let field = TextEdit::singleline(&mut text).desired_width(120.0).hint_text("a number");
            let field = ui.add(field).labelled_by(name.id);
            let field = field.on_hover_text("a click selects a label; or write its number and press Enter");
            if field.changed() {
                (self.label, self.label_error) = (Some(text.clone()), None);
            }
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            let find = ui.add_enabled(self.label.is_some(), Button::new("Find"));
            if self.label.is_some() && (is_entered || find.clicked()) {
                let shown = look.labels.shown.unwrap_or(0);
                let label = parse_label(&text).map_err(str::to_owned);
                let label = label.and_then(|label| facts.label_fault(shown, label).map_or(Ok(label), Err));
                match label {
                    Ok(label) => {
                        (self.label, look.labels.selected) = (None, Some(label));
                        asked.push(VolumeChange::FindLabel(label));
                    }
                    Err(why) => self.label_error = Some(why),
                }
            } else if field.lost_focus() && self.label_error.is_none() && !find.hovered() {
                self.label = None;
            }
            let has_any = look.labels.selected.is_some();
            let none = ui.add_enabled(has_any, Button::new("None"));
            if none.on_hover_text("select no label: Escape").clicked() {
                (look.labels.selected, self.label, self.label_error) = (None, None, None);
            }
        });
        if let Some(why) = &self.label_error {
            ui.label(RichText::new(why).color(ui.visuals().error_fg_color));
        }
        if look.labels.selected.is_some() {
            ui.horizontal(|ui| {
                ui.label("Others");
                for others in OtherLabels::ALL {
                    if ui.selectable_label(look.labels.others == others, others.name()).clicked() {
                        look.labels.others = others;
                    }
                }
            });
        }
    }
}

/// A range of stored values that a person changed: of finite ends that can be told apart. The end that was
/// moved onto the other one stays on its own side of it.
fn kept_apart(range: [f64; 2], before: [f64; 2]) -> [f64; 2] {
    let end = |nth: usize| match range[nth].is_finite() {
        true => range[nth].clamp(-MOST_END, MOST_END),
        false => before[nth],
    };
    let mut kept = [end(0), end(1)];
    let apart = least_apart(kept);
    if range != before && (kept[1] - kept[0]).abs() < apart {
        let moved = usize::from(kept[1] != before[1]);
        let side = if before[moved] < before[1 - moved] { -1.0 } else { 1.0 };
        kept[moved] = kept[1 - moved] + side * apart;
    }
    kept
}

/// What a range becomes.
fn strip(ui: &mut Ui, channel: &ChannelLook, is_turned: bool) {
    const PARTS: usize = 48;
    let (rect, _) =
        ui.allocate_exact_size(egui::vec2(ui.available_width().min(290.0), 8.0), egui::Sense::hover());
    for nth in 0..PARTS {
        let at = (nth as f32 + 0.5) / PARTS as f32;
        let [r, g, b] = channel.color_at(if is_turned { 1.0 - at } else { at });
        let column = |n: usize| rect.left() + rect.width() * n as f32 / PARTS as f32;
        let part = egui::Rect::from_x_y_ranges(column(nth)..=column(nth + 1) + 0.5, rect.y_range());
        ui.painter().rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
}

/// Whether a colour map makes the colours, and which.
fn map_controls(ui: &mut Ui, map: &mut Option<Palette>) {
    let mut has_map = map.is_some();
    let what = "in the place of the one colour: of each value one of its own";
    if ui.checkbox(&mut has_map, "Colours by a map").on_hover_text(what).changed() {
        *map = has_map.then_some(Palette::VIRIDIS);
    }
    if let Some(map) = map {
        palette_controls(ui, map);
    }
}

/// Gives a control the name that it is known by to those who do not see it.
fn named(response: &Response, name: &str) {
    let (name, is_enabled) = (name.to_owned(), response.enabled());
    response.widget_info(move || WidgetInfo::labeled(egui::Role::Button, is_enabled, &name));
}

fn layouts(ui: &mut Ui, look: &mut VolumeLook, asked: &mut Vec<VolumeChange>) {
    ui.horizontal_wrapped(|ui| {
        let one = VolumeLayout::One;
        let choices = [
            (VolumeLayout::Four, "Four", "three slices and 3-D: 4"),
            (one(VolumePane::Z), "Z", "the slice across z: Z"),
            (one(VolumePane::X), "X", "the slice across x: X"),
            (one(VolumePane::Y), "Y", "the slice across y: Y"),
            (one(VolumePane::Space), "3-D", "all of it: V; Space goes from a slice to it and back"),
        ];
        for (layout, name, what) in choices {
            if ui.selectable_label(look.layout == layout, name).on_hover_text(what).clicked() {
                look.layout = layout;
            }
        }
        if ui.button("Show all").on_hover_text("as at first: 0").clicked() {
            asked.push(VolumeChange::Fit);
        }
    });
}

fn modes(ui: &mut Ui, look: &mut VolumeLook, told: &VolumeStatus<'_>) {
    ui.horizontal_wrapped(|ui| {
        for (mode, what) in VolumeMode::ALL.into_iter().zip(MODES) {
            if ui.selectable_label(look.mode == mode, mode.name()).on_hover_text(what).clicked() {
                look.mode = mode;
            }
        }
    });
    match look.mode {
        VolumeMode::Emission => {
            ui.add(Slider::new(&mut look.density, 0.05..=20.0).logarithmic(true).text("Density"));
        }
        VolumeMode::Iso => {
            let range = look.shown().find_map(|nth| look.channels[nth].range).unwrap_or([0.0, 1.0]);
            let (low, high) = (range[0].min(range[1]), range[0].max(range[1]));
            let mut iso = look.iso.unwrap_or((low + high) / 2.0);
            let ends = low.min(iso)..=high.max(iso);
            let slider = Slider::new(&mut iso, ends).text("Surface at");
            if ui.add(slider).changed() {
                look.iso = Some(iso);
            }
        }
        VolumeMode::Mip => {
            if let Some(said) = dimmer_text(told.facts) {
                ui.label(RichText::new(said).weak());
            }
        }
        VolumeMode::Minip | VolumeMode::Average => {}
    }
    ui.horizontal(|ui| {
        ui.label("Step");
        for (step, name) in [(LONGEST_STEP, "2"), (1.0, "1"), (1.0 / 3.0, "1/3"), (1.0 / 5.0, "1/5")] {
            let label = ui.selectable_label(look.step == step, name);
            if label.on_hover_text("samples along a ray, in sides of a voxel").clicked() {
                look.step = step;
            }
        }
    });
}

fn times(ui: &mut Ui, look: &mut VolumeLook, told: &VolumeStatus<'_>, asked: &mut Vec<VolumeChange>) {
    let times = told.facts.times;
    if times < 2 {
        return;
    }
    ui.horizontal(|ui| {
        let name = if told.is_playing { "Stop" } else { "Play" };
        if ui.button(name).on_hover_text("times, one after the other: K").clicked() {
            asked.push(VolumeChange::Play(!told.is_playing));
        }
        ui.spacing_mut().slider_width = 150.0;
        ui.add(Slider::new(&mut look.time, 0..=times - 1).text("Time"));
        if told.seen_time != look.time {
            ui.spinner();
        }
    });
}

fn crosshair(ui: &mut Ui, look: &mut VolumeLook, told: &VolumeStatus<'_>) {
    let of = &told.facts.of;
    let voxel = look.voxel(of);
    ui.horizontal(|ui| {
        for axis in 0..3 {
            let mut at = voxel[axis];
            let last = of.size[axis].saturating_sub(1);
            let drag = DragValue::new(&mut at).range(0..=last).prefix(format!("{} ", AXES[axis]));
            let drag = ui.add(drag).on_hover_text("voxel of the crosshair");
            named(&drag, &format!("crosshair {}", AXES[axis]));
            if drag.changed() {
                look.step_slice(of, axis, i64::from(at) - i64::from(voxel[axis]));
            }
        }
    });
    ui.label(place_text(told.facts, look.cross));
    CollapsingHeader::new("Tilted slices").show(ui, |ui| tilts(ui, look, of));
    if let Some(clicked) = told.clicked {
        egui::Grid::new("values").num_columns(2).spacing([16.0, 2.0]).show(ui, |ui| {
            for (name, value) in point_rows(told.facts, clicked) {
                ui.label(name);
                ui.label(RichText::new(value).monospace());
                ui.end_row();
            }
        });
    }
}

/// How far each slice is turned.
fn tilts(ui: &mut Ui, look: &mut VolumeLook, of: &VolumeBox) {
    let before = look.tilts;
    for (axis, tilt) in look.tilts.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            ui.label(AXES[axis].to_uppercase());
            let ends = [
                (&mut tilt.yaw, "yaw", "about what is downward"),
                (&mut tilt.pitch, "pitch", "about what is to the right"),
            ];
            for (degrees, name, what) in ends {
                let drag = DragValue::new(degrees).range(-89.0..=89.0).speed(0.5).max_decimals(1).suffix("°");
                let drag =
                    ui.add(drag.prefix(format!("{name} "))).on_hover_text(format!("{what} in its picture"));
                named(&drag, &format!("tilt {} {name}", AXES[axis]));
            }
        });
    }
    let is_upright = look.is_upright();
    let upright = ui.add_enabled(!is_upright, Button::new("Upright"));
    let is_asked =
        upright.on_hover_text("all slices upright on their axes: T; Ctrl + drag tilts one").clicked();
    // Upright slices go through the middles of voxels.
    if is_asked || is_upright && before != look.tilts {
        look.put_upright(of);
    }
}

fn clip(ui: &mut Ui, clip: &mut ClipLook) {
    for (axis, shares) in clip.shares.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = 78.0;
            let [low, high] = shares;
            ui.label(AXES[axis]);
            for (value, end) in [(low, "from"), (high, "to")] {
                let slider = Slider::new(value, 0.0..=1.0).show_value(false);
                named(&ui.add(slider), &format!("{} {end}", AXES[axis]));
            }
        });
        shares[1] = shares[1].max(shares[0]);
    }
    ui.checkbox(&mut clip.has_plane, "Plane");
    if clip.has_plane {
        ui.add(Slider::new(&mut clip.plane_yaw, -180.0..=180.0).suffix("°").text("Yaw"));
        ui.add(Slider::new(&mut clip.plane_pitch, -90.0..=90.0).suffix("°").text("Pitch"));
        ui.add(Slider::new(&mut clip.plane_depth, 0.0..=1.0).text("Depth"));
    }
    if ui.add_enabled(*clip != ClipLook::default(), egui::Button::new("Nothing")).clicked() {
        *clip = ClipLook::default();
    }
}

fn state(ui: &mut Ui, look: &VolumeLook, told: &VolumeStatus<'_>) {
    let mut said = format!("{:.0} % at the wanted level", (100.0 * told.share).floor());
    if told.missing > 0 {
        said += &format!(", {} bricks to come", told.missing);
    }
    ui.label(said);
    if told.bias > 0.0 {
        ui.label(format!("{:.1} levels coarser, so that all of it fits into the pool", told.bias));
    }
    if let Some(cut) = &told.cut {
        ui.label(ray_cut_text(cut));
    }
    if look.shown().next().is_none() && !look.channels.is_empty() {
        ui.label("No channel is shown.");
    }
}

#[cfg(test)]
mod tests;
