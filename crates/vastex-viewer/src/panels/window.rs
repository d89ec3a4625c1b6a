//! What is in a window beside the picture: a button, the panel that it opens, the list of keys, guides over
//! an image, and what there is to say.

mod bands;
mod images;
mod room;
mod told;
mod volume;
mod welcome;

use std::ffi::OsStr;

use egui::accesskit::Live;
use egui::{
    Align2, Area, Button, CollapsingHeader, Color32, ComboBox, Context, Frame, Id, ProgressBar, RichText,
    ScrollArea, TextEdit, TextStyle, ThemePreference, Ui, Vec2,
};
use glam::DVec2;

use super::messages::say_to_readers;
use super::{
    BookmarksPanel, DisplayPanel, InfoPanel, Measure, PositionChange, PositionPanel, TexelSize, foot_rise,
    keys_window_of, planet_controls, status_line,
};
use crate::camera::Pose;
use crate::input::{CONTROLS, DROPS, WITHOUT_DROPS};
use crate::remembered::{ChosenGround, Remembered};
use crate::scene::Scene;
use bands::bands_of_file;
pub use images::OfferedImages;
use images::{ImagesPanel, images_of_file};
use room::{PANEL_WIDTH, Room};
pub use told::{WindowAsked, WindowStatus};
pub use volume::WindowOfVolume;
use welcome::welcome;

/// A window's panel, as a person left it. The same one goes on from frame to frame.
pub struct WindowPanel {
    is_open: bool,
    room: Room,
    /// True if the field for a path is to have the keys.
    wants_path: bool,
    keys_are_shown: bool,
    /// What is written in the field for a file.
    path: String,
    guides_are_shown: bool,
    values_are_shown: bool,
    /// True if values are shown also where guides are hidden and the panel is closed.
    values_stand_alone: bool,
    position: PositionPanel,
    views: BookmarksPanel,
    info: InfoPanel,
    /// Images that something lists, to choose from.
    images: ImagesPanel,
    /// What is measured in the image, while that is done.
    pub measure: Option<Measure>,
    /// How layers are displayed.
    pub display: DisplayPanel,
    /// The corners of what was covered by nothing in the last frame, in pixels; `None` before the first.
    pub free: Option<[DVec2; 2]>,
    /// What the picture lies on.
    pub ground: ChosenGround,
    /// True if files that are dropped onto the window do not reach it.
    pub(crate) lacks_drops: bool,
}

impl Default for WindowPanel {
    fn default() -> WindowPanel {
        WindowPanel {
            is_open: false,
            room: Room::default(),
            wants_path: false,
            keys_are_shown: false,
            path: String::new(),
            guides_are_shown: true,
            values_are_shown: true,
            values_stand_alone: false,
            position: PositionPanel::default(),
            views: BookmarksPanel::default(),
            info: InfoPanel::default(),
            images: ImagesPanel::default(),
            measure: None,
            display: DisplayPanel::default(),
            free: None,
            ground: ChosenGround::default(),
            lacks_drops: false,
        }
    }
}

impl WindowPanel {
    /// Shows the panel, guides and values, or hides them, as when the window was closed last.
    pub fn show_as_before(&mut self, before: &Remembered) {
        (self.is_open, self.guides_are_shown) = (before.panel_is_open, !before.guides_are_hidden);
        self.values_are_shown = !before.values_are_hidden;
        self.ground = before.ground;
    }

    /// Returns true if the panel is open; where there is no room for it, it is not seen all the same.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Returns true if the panel is open and seen.
    fn is_seen(&self) -> bool {
        self.is_open && self.room.has_panel()
    }

    /// Opens the panel, also where it gave way to what the machine does.
    pub fn open(&mut self) {
        self.is_open = true;
        self.room.panel_comes();
    }

    /// Opens the panel, or closes it where it is seen.
    pub fn open_or_close(&mut self) {
        if self.is_seen() { self.is_open = false } else { self.open() }
    }

    /// Opens the panel, with the keys in the field for a path.
    pub fn ask_for_path(&mut self) {
        self.open();
        self.wants_path = true;
    }

    /// Opens the panel where it has what the file says of itself.
    pub fn show_about(&mut self) {
        self.open();
        self.info.open();
    }

    /// Offers images that something lists, in the place of those before: in the panel, or in the middle of a
    /// window that displays nothing.
    pub fn offer(&mut self, images: OfferedImages) {
        self.images.offer(images);
    }

    /// The images that are offered, if any are.
    pub fn offered(&self) -> Option<&OfferedImages> {
        self.images.offered()
    }

    /// What a path opens is displayed: unless that is one of the images that are offered, these are offered
    /// no more.
    pub fn turn_to(&mut self, path: &OsStr) {
        self.images.turn_to(path);
    }

    /// Returns true if a window, of which nothing is taken yet, has room for what the machine does beside
    /// this, if that `is_shown` at all. Where there is room for one of them, the one that came last has it;
    /// where there is room for none, one that was asked for.
    pub fn leaves_room_beside(&mut self, ui: &Ui, is_shown: bool) -> bool {
        self.room.measure(ui.available_width(), is_shown);
        !self.hides_machine()
    }

    /// Returns true if what the machine does gives way to this, or to the picture.
    pub fn hides_machine(&self) -> bool {
        !self.room.has_machine(self.is_open)
    }

    /// What the machine does was asked for.
    pub fn machine_comes(&mut self) {
        self.room.machine_comes();
    }

    /// Returns true if guides lie over an image.
    pub fn guides_are_shown(&self) -> bool {
        self.guides_are_shown
    }

    /// Shows guides over an image, or hides them.
    pub fn show_or_hide_guides(&mut self) {
        self.guides_are_shown = !self.guides_are_shown;
        // Without guides the picture is alone.
        self.values_stand_alone = false;
    }

    /// Returns true if a line at the foot of the picture says what lies below the pointer.
    pub fn values_are_shown(&self) -> bool {
        self.values_are_shown
    }

    /// Returns true if that line has its place in a window that does not fill the screen: beside guides or an
    /// open panel, or without them where it was asked for.
    pub fn values_have_place(&self) -> bool {
        self.is_open || self.guides_are_shown || self.values_stand_alone
    }

    /// Shows the line at the foot of the picture, or hides it if it is seen. `has_place` is true where it has
    /// its place whether guides and panel are there or not.
    pub fn show_or_hide_values(&mut self, has_place: bool) {
        let is_seen = self.values_are_shown && (has_place || self.values_have_place());
        (self.values_are_shown, self.values_stand_alone) = (!is_seen, !is_seen);
    }

    /// Shows the list of keys, or hides it.
    pub fn show_or_hide_keys(&mut self) {
        self.keys_are_shown = !self.keys_are_shown;
    }

    /// Hides the list of keys. Returns true if it was shown.
    pub fn hide_keys(&mut self) -> bool {
        std::mem::take(&mut self.keys_are_shown)
    }

    /// Shows everything beside an image or another scene. Gives back what is asked for, and true if the
    /// display of the texture is to be another.
    pub fn show(&mut self, ui: &mut Ui, told: &mut WindowStatus<'_>) -> (Vec<WindowAsked>, bool) {
        let (mut asked, mut is_changed) = (Vec::new(), false);
        if self.is_seen() {
            let panel = egui::Panel::right("panel").resizable(false).exact_size(PANEL_WIDTH);
            panel.show(ui, |ui| {
                ui.add_space(4.0);
                ui.horizontal(|ui| {
                    ui.add(egui::Label::new(RichText::new(told.name).strong()).truncate());
                });
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    self.files(ui, told.recent, told.texture.is_some(), &mut asked);
                    if told.texture.is_some() {
                        self.images.show(ui, &mut asked);
                    }
                    images_of_file(ui, told.images, &mut asked);
                    told.bands.iter().for_each(|bands| bands_of_file(ui, bands, &mut asked));
                    self.info.show(ui, told.rows);
                    ui.separator();
                    places(ui, told.scene, &mut asked);
                    if told.texture.is_some() {
                        self.position(ui, told, &mut asked);
                    }
                    ui.separator();
                    if let Some(planet) = &mut told.planet {
                        planet_controls(ui, planet);
                        ui.separator();
                    }
                    if let Some(texture) = &mut told.texture {
                        is_changed = self.display.show(ui, texture);
                    }
                    ui.separator();
                    theme(ui);
                    ground(ui, &mut self.ground);
                });
            });
        }
        if !self.is_seen() {
            let corner = Area::new(Id::unique("corner")).anchor(Align2::RIGHT_TOP, Vec2::new(-8.0, 8.0));
            corner.show(ui.ctx(), |ui| {
                if ui.button("Panel").on_hover_text("files and display: M; keys: ?").clicked() {
                    self.open();
                }
            });
        }
        if told.texture.is_none() && self.images.offered().is_some() {
            self.images.show_alone(ui, &mut asked);
        } else if told.texture.is_none() && told.opening.is_none() {
            welcome(ui, (&mut self.path, told.recent), self.lacks_drops, &mut asked);
        }
        self.keys(ui.ctx(), CONTROLS);
        say(ui, told);
        (asked, is_changed)
    }

    /// The list of keys, while it is shown; of what the window lacks it says how to do without.
    fn keys(&mut self, context: &Context, controls: &[(&str, &[(&str, &str)])]) {
        if !self.keys_are_shown {
            return;
        }
        let said = |&(keys, meaning)| match keys == DROPS && self.lacks_drops {
            true => (keys, WITHOUT_DROPS),
            false => (keys, meaning),
        };
        let parts: Vec<_> =
            controls.iter().map(|(_, keys)| keys.iter().map(said).collect::<Vec<_>>()).collect();
        let parts: Vec<_> = controls.iter().zip(&parts).map(|((part, _), keys)| (*part, &**keys)).collect();
        keys_window_of(context, &mut self.keys_are_shown, &parts);
    }

    fn position(&mut self, ui: &mut Ui, told: &WindowStatus<'_>, asked: &mut Vec<WindowAsked>) {
        let (pose, size) = &told.position;
        match self.position.show(ui, pose, (*size, told.map), told.bookmarks) {
            Some(PositionChange::Go(pose)) => asked.push(WindowAsked::Go(pose)),
            Some(PositionChange::Show(view)) => asked.push(WindowAsked::Show(view)),
            Some(PositionChange::Copy) => asked.push(WindowAsked::CopyView),
            Some(PositionChange::Move(moved)) => asked.push(WindowAsked::Move(moved)),
            Some(PositionChange::CopyLink) => asked.push(WindowAsked::CopyLink),
            Some(PositionChange::Keep(name)) => asked.push(WindowAsked::Keep(name)),
            Some(PositionChange::Forget(index)) => asked.push(WindowAsked::Forget(index)),
            None => {}
        }
        ui.checkbox(&mut self.guides_are_shown, "Guides")
            .on_hover_text("a map, a scale, lines between large texels with their values: G");
        ui.checkbox(&mut self.values_are_shown, "Value below the pointer")
            .on_hover_text("a line at the foot of the picture: J");
        if matches!(pose, Pose::Image { .. }) {
            self.measuring(ui, told.texel_size);
        }
    }

    fn measuring(&mut self, ui: &mut Ui, texel_size: Option<&TexelSize>) {
        ui.horizontal_wrapped(|ui| {
            let mut is_measuring = self.measure.is_some();
            let measure = ui.checkbox(&mut is_measuring, "Measure");
            let what =
                "a click sets a point, a double click closes the line, Backspace takes the last one back: K";
            if measure.on_hover_text(what).changed() {
                self.measure = is_measuring.then(Measure::default);
            }
            if let Some(measured) = self.measure.as_ref().and_then(|measure| measure.text(texel_size)) {
                ui.label(measured);
            }
        });
    }

    /// `has_file` says that one is displayed, which another may lie over.
    fn files(&mut self, ui: &mut Ui, recent: &[String], has_file: bool, asked: &mut Vec<WindowAsked>) {
        ui.horizontal_wrapped(|ui| {
            let buttons = [
                ("Open…", WindowAsked::Choose),
                ("Previous", WindowAsked::File(-1)),
                ("Next", WindowAsked::File(1)),
            ];
            for (name, asks) in buttons {
                if ui.button(name).clicked() {
                    asked.push(asks);
                }
            }
            if ui.button("Keys").clicked() {
                self.keys_are_shown = true;
            }
            if ui.button("Hide").on_hover_text("the panel: M").clicked() {
                self.is_open = false;
            }
        });
        ui.horizontal(|ui| {
            let label = ui.label("Path");
            let field = TextEdit::singleline(&mut self.path).desired_width(ui.available_width() - 128.0);
            let field = ui.add(field).labelled_by(label.id);
            if std::mem::take(&mut self.wants_path) {
                field.request_focus();
            }
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            let path = self.path.trim();
            let go = ui.add_enabled(!path.is_empty(), Button::new("Open"));
            if !path.is_empty() && (is_entered || go.clicked()) {
                asked.push(WindowAsked::Open(path.into()));
            }
            let over = ui.add_enabled(has_file && !path.is_empty(), Button::new("Lay over"));
            if over.on_hover_text("over what is shown, as a layer to compare with it").clicked() {
                asked.push(WindowAsked::LayOver(path.into()));
            }
        });
        ui.horizontal_wrapped(|ui| {
            if ui.button("Open folder…").on_hover_text("tiles or a volume that lie in a folder").clicked() {
                asked.push(WindowAsked::ChooseFolder);
            }
            let over = ui.add_enabled(has_file, Button::new("Lay over a file…"));
            if over.on_hover_text("choose a file to lie over what is shown").clicked() {
                asked.push(WindowAsked::ChooseOver);
            }
        });
        if !recent.is_empty() {
            CollapsingHeader::new("Recent files").show(ui, |ui| {
                for file in recent {
                    let button = ui.add(Button::new(name_of(file)).frame(false).truncate());
                    if button.on_hover_text(file).clicked() {
                        asked.push(WindowAsked::Open(file.into()));
                    }
                }
            });
        }
    }
}

/// The last part of a path, or all of one that ends without any.
fn name_of(path: &str) -> &str {
    let name = path.trim_end_matches('/').rsplit('/').next();
    let name = name.and_then(|name| name.rsplit(if cfg!(windows) { '\\' } else { '/' }).next());
    name.filter(|name| !name.is_empty()).unwrap_or(path)
}

/// Light, dark, or as the system is.
fn theme(ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label("Theme");
        let shown = ui.ctx().options(|options| options.theme_preference);
        let choices = [
            (ThemePreference::System, "system"),
            (ThemePreference::Dark, "dark"),
            (ThemePreference::Light, "light"),
        ];
        for (theme, name) in choices {
            if ui.selectable_label(theme == shown, name).clicked() {
                ui.ctx().set_theme(theme);
            }
        }
    });
}

/// What is seen around the picture and through it.
fn ground(ui: &mut Ui, chosen: &mut ChosenGround) {
    let choice = ComboBox::from_label("Ground").selected_text(chosen.name()).show_ui(ui, |ui| {
        for ground in ChosenGround::ALL {
            ui.selectable_value(chosen, ground, ground.name());
        }
    });
    choice.response.on_hover_text("around the picture, and where it is transparent or without data");
}

/// What the texture lies on.
fn places(ui: &mut Ui, shown: Scene, asked: &mut Vec<WindowAsked>) {
    ui.horizontal_wrapped(|ui| {
        for scene in Scene::ALL {
            if ui.selectable_label(scene == shown, scene.name()).clicked() && scene != shown {
                asked.push(WindowAsked::Scene(scene));
            }
        }
        if ui.button("Show all").clicked() {
            asked.push(WindowAsked::Fit);
        }
    });
}

/// What there is to say, at the foot of the picture.
fn say(ui: &Ui, told: &WindowStatus<'_>) {
    let free = ui.available_rect_before_wrap();
    let at = (free, told.panes);
    let rise = told.below.map_or_else(|| foot_rise(free, told.panes), |text| status_line(ui.ctx(), at, text));
    say_below(ui, (told.notice, told.opening), rise);
}

/// Points that a bar is wide at least, and beyond the words on it.
const LEAST_BAR: f32 = 260.0;
const BAR_MARGIN: f32 = 24.0;

/// Shows a notice, if there is one, and the name of what is being opened with how much of it is done, 0 to 1,
/// so many points above the foot of what no panel covers.
pub fn say_below(ui: &Ui, (notice, opening): (Option<&str>, Option<(&str, f64)>), rise: f32) {
    if notice.is_none() && opening.is_none() {
        return;
    }
    // At the foot of what no panel covers.
    let free = ui.available_rect_before_wrap();
    let foot = Area::new(Id::unique("foot")).pivot(Align2::LEFT_BOTTOM).interactable(false);
    let foot = foot.fixed_pos(free.left_bottom() + Vec2::new(8.0, -8.0 - rise));
    foot.show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(free.width().clamp(100.0, 700.0) - 40.0);
            if let Some(notice) = notice {
                say_to_readers(&ui.label(notice), Live::Polite);
            }
            if let Some((name, share)) = opening {
                let text = format!("opening {name} – {:.0} %", (100.0 * share).floor());
                let font = TextStyle::Button.resolve(ui.style());
                let written = ui.painter().layout_no_wrap(text.clone(), font, Color32::PLACEHOLDER);
                let width =
                    (written.size().x + BAR_MARGIN).clamp(LEAST_BAR, ui.max_rect().width().max(LEAST_BAR));
                ui.add(ProgressBar::new(share as f32).desired_width(width).text(text));
            }
        });
    });
}

#[cfg(test)]
mod tests;
