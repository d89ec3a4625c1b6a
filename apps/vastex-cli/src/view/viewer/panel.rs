//! The panel in the window: what it is told of what is displayed, and what becomes of what a person changes
//! in it.

use std::time::{Duration, Instant};

use glam::DVec2;
use vastex_scenes::{LayerOptions, Pose, Scene};
use vastex_viewer::inspect::Histogram;
use vastex_viewer::layers::StoredScale;
use vastex_viewer::panels::{ImageView, Minimap, ShownTextures, swipe_line};
use vastex_viewer::surface::MOST_STOPS;
use winit::event::WindowEvent;

use super::super::panel::{Asked, Told};
use super::super::shell::Heard;
use super::Viewer;
use crate::screenshot::Guided;

/// Between two looks at the values of a view that changes.
pub(super) const EVERY: Duration = Duration::from_millis(300);

/// Points that the titles of panes take at the top.
const TITLES: f32 = 32.0;

/// Values that are in view.
pub(super) struct Values {
    /// `None` if no part of the image is in view.
    histogram: Option<Histogram>,
    /// Of which of the shown layers.
    layer: usize,
    taken_at: Instant,
    /// True if they are those of a view that had settled.
    are_last: bool,
}

impl Values {
    /// The view is another than the one that they are of.
    pub(super) fn age(&mut self) {
        self.are_last = false;
    }
}

/// What is said of the system's dialog for files, as a topic.
pub(in super::super) const DIALOG: &str = "dialog";

/// The corners of a part of the window, in whole pixels.
fn corners_of(part: egui::Rect, pixels_per_point: f32) -> [DVec2; 2] {
    [part.min, part.max]
        .map(|corner| (DVec2::new(corner.x.into(), corner.y.into()) * f64::from(pixels_per_point)).round())
}

impl Viewer {
    /// Hears an event before the picture does.
    pub(in super::super) fn hear(&mut self, event: &WindowEvent) -> Heard {
        let heard = self.shell.hear(event);
        #[cfg(feature = "volumes")]
        if heard.is_stale {
            self.refresh_volume();
        }
        heard
    }

    /// What was asked for in the panel since the last call.
    pub(in super::super) fn take_asked(&mut self) -> Vec<Asked> {
        std::mem::take(&mut self.asked)
    }

    /// Opens the panel, or closes it.
    pub(in super::super) fn open_or_close_panel(&mut self) {
        self.panel.open_or_close();
    }

    /// Opens the panel, and gives its first control the keys.
    pub(in super::super) fn enter_panel(&mut self) {
        self.panel.open();
        self.shell.focus_next();
    }

    /// Opens the panel where it has what the file says of itself.
    pub(in super::super) fn show_about(&mut self) {
        self.panel.show_about();
    }

    /// There is no dialog for files: opens the panel with the keys in the field for a path, and says so until
    /// that is read or a file is opened.
    pub(in super::super) fn offer_path_field(&mut self) {
        self.panel.ask_for_path();
        let said = "This system shows no dialog for files. Write the path of one into the field \"Path\" of the panel.";
        self.say_wrong(DIALOG, said);
    }

    /// Shows the keys and gestures, or hides them.
    pub(in super::super) fn show_or_hide_keys(&mut self) {
        self.panel.show_or_hide_keys();
    }

    /// Hides the keys and gestures. Returns true if they were shown.
    pub(in super::super) fn hide_keys(&mut self) -> bool {
        self.panel.hide_keys()
    }

    /// Shows the guides over an image, or hides them.
    pub(in super::super) fn show_or_hide_guides(&mut self) {
        self.panel.show_or_hide_guides();
    }

    /// A file is displayed: its bookmarks are those of the panel.
    pub(in super::super) fn turn_to_bookmarks(&mut self, file: &std::path::Path) {
        self.panel.bookmarks.turn_to(file);
    }

    /// A file is displayed: the panel offers it from now on.
    pub(in super::super) fn remember(&mut self, file: &std::path::Path) {
        self.panel.recent.add(file);
    }

    /// Runs the panel for the frame that comes, and displays what was changed in it.
    pub(super) fn run_panel(&mut self, pose: Pose) {
        self.title.expire(Instant::now());
        self.look_for_first_ranges();
        self.look_at_values(pose);
        let is_settled = self.is_settled(&self.textures.stats());
        let name = self.name().to_owned();
        let shown = self.panel_textures();
        let hud_data = self.hud_data();
        let mut options = self.settings.options.layers.clone();
        let mut compare_mode = self.settings.options.compare_mode;
        let mut planet = self.settings.options.planet.clone();
        let (mut asked, mut is_changed) = (Vec::new(), false);
        let histogram = self.values.as_ref().and_then(|values| values.histogram.as_ref());
        let (panes, pointer) = (self.panes(), self.pointer);
        let below = self.line_below(&pose);
        self.below.show(below.clone(), Instant::now());
        let titles = self.pane_titles(&panes, &pose);
        let view = ImageView { pose, picture: self.size(), image: self.image_size(), left: 0 };
        let (panel, settings, textures) = (&mut self.panel, &self.settings, &self.textures);
        // An overlay is no picture of texels.
        let guided = self.display.displayed().filter(|source| source.is_whole() && source.overlay.is_none());
        let texel_size = guided.and_then(|source| source.about.texel_size.as_ref());
        let shapes = self.shapes.as_ref().filter(|(opening, _)| *opening == self.layers_of);
        let shapes = shapes.filter(|_| guided.is_some()).map(|(_, shapes)| shapes);
        let guided = guided.map(|source| &source.renderer);
        let images = self.display.displayed().map_or(&[][..], |source| &source.about.images);
        let bands = self.display.displayed().and_then(|source| source.about.bands.as_ref());
        let map = self.display.displayed().and_then(|source| source.about.map.as_ref());
        let rows = self.display.displayed().map_or(&[][..], |source| &source.about.rows);
        let is_compared = guided.is_some_and(|renderer| renderer.layers().can_compare());
        let (before, free_before) = (panel.display.clone(), panel.free);
        let (opening, notice) = (self.opening.as_ref(), self.title.notice());
        self.shown_notice = notice.map(str::to_owned);
        let (minimaps, is_hidden) = (&mut self.minimaps, self.is_hidden);
        minimaps.resize_with(panes.count as usize, Minimap::default);
        let (hud, mut hud_changes) = (&mut self.hud.panel, Vec::new());
        let messages = &mut self.messages;
        self.shell.run(|ui| {
            if panel.leaves_room_beside(ui, hud_data.is_some())
                && let Some(data) = &hud_data
            {
                hud_changes = hud.show(ui, data);
            }
            let texture = shown.as_ref().map(|textures| ShownTextures {
                textures,
                shown: &mut options,
                compare_mode: &mut compare_mode,
                histogram,
            });
            let mut told = Told {
                name: &name,
                opening: opening.map(|(name, share)| (&**name, *share)),
                notice,
                below: below.as_deref(),
                scene: settings.scene,
                position: (pose, view.image),
                texel_size,
                map,
                images,
                bands,
                planet: (settings.scene == Scene::Planet).then_some(&mut planet),
                rows,
                texture,
            };
            let (asks, changes) = panel.show(ui, &mut told);
            let all = ui.available_rect_before_wrap();
            panel.free = Some(corners_of(all, ui.pixels_per_point()));
            let free = |pane: u32| panes.rect(pane, all, ui.pixels_per_point());
            // What lies over the image lies over it in each pane that a panel leaves something of.
            let seen = || (0..panes.count).filter(|pane| free(*pane).is_positive());
            if is_compared {
                swipe_line(ui.ctx(), free(0), view.picture[0], &mut compare_mode);
            }
            if let Some(renderer) = guided.filter(|_| panel.guides_are_shown()) {
                let shapes = shapes.map(|shapes| &**shapes);
                let is_seen = !is_hidden;
                let guided =
                    Guided { textures, renderer, view: &view, texel_size, shapes, is_settled, is_seen };
                for pane in seen() {
                    let Some(minimap) = minimaps.get_mut(pane as usize) else { continue };
                    asked.extend(guided.show(ui, pane, free(pane), minimap).map(Asked::Go));
                }
            }
            // What is measured, and what panes are called, is read over values of texels and a map.
            if let Some(measure) = panel.measure.as_ref().filter(|_| guided.is_some()) {
                for pane in seen() {
                    let view = ImageView { left: pane * panes.width, ..view };
                    measure.paint(ui.painter(), free(pane), &view, texel_size);
                }
            }
            panes.paint(ui.painter(), all, &titles, pointer);
            // Titles of panes stay to be read.
            let top = if panes.count > 1 { all.top() + TITLES } else { all.top() };
            messages.show(ui.ctx(), all.with_min_y(top));
            asked.extend(asks);
            is_changed |= changes;
        });
        self.asked.extend(asked);
        if self.panel.free != free_before {
            // All of an image is somewhere else in the next frame, and other values are in view.
            self.unsettled = self.unsettled.max(1);
            self.values.iter_mut().for_each(Values::age);
            self.minimaps.iter_mut().for_each(Minimap::age);
        }
        if self.panel.display != before {
            // Another layer's values, or others of them, count from the next frame on.
            self.values = None;
            self.wake();
        }
        if std::mem::replace(&mut self.settings.options.compare_mode, compare_mode) != compare_mode {
            // Panes show other parts of the image than one picture.
            self.wake();
        }
        if self.settings.options.planet != planet {
            self.light_planet(planet);
        }
        if is_changed && self.settings.options.layers != options {
            self.show_layers(options);
            // A layer that was chosen or reset has its first range in the same frame.
            self.look_for_first_ranges();
        }
        hud_changes.iter().for_each(|change| self.change(change));
    }

    /// Looks at the values in view while the panel shows them, no more often than they are of use.
    fn look_at_values(&mut self, pose: Pose) {
        let Some(displayed) =
            self.display.displayed().filter(|source| source.is_whole() && self.panel.is_open())
        else {
            return;
        };
        let (layer, now) = (self.panel.display.layer(), Instant::now());
        let is_settled = self.is_settled(&self.textures.stats());
        let is_due = self.values.as_ref().is_none_or(|values| {
            let is_old = now.duration_since(values.taken_at) >= EVERY;
            values.layer != layer || if is_settled { !values.are_last } else { is_old }
        });
        if !is_due {
            return;
        }
        let shown = displayed.renderer.layers().iter().nth(layer).map(|shown| (shown.layer, shown.color_map));
        let (sizes, free) = ((self.size(), displayed.size), Some(self.free()));
        let histogram = shown.as_ref().and_then(|(layer, map)| {
            Histogram::of_view(&self.textures, &displayed.renderer, (*layer, map), &pose, sizes, free)
        });
        let range = histogram.as_ref().filter(|_| self.panel.display.follows());
        let range = range.and_then(|values| self.automatic_range(shown?.0, values));
        self.values = Some(Values { histogram, layer, taken_at: now, are_last: is_settled });
        let unsettled = self.unsettled;
        if let Some(range) = range {
            self.set_range(layer, range);
        }
        // The pages that are wanted are the same.
        self.unsettled = unsettled;
    }

    /// Makes black and white what they are by the values in view, of the layer that the panel changes.
    pub(in super::super) fn set_automatic_range(&mut self, pose: Pose) {
        let Some(displayed) = self.display.displayed().filter(|source| source.is_whole()) else {
            return;
        };
        let layer = self.panel.display.layer();
        let shown = displayed.renderer.layers().iter().nth(layer).map(|shown| (shown.layer, shown.color_map));
        let (sizes, free) = ((self.size(), displayed.size), Some(self.free()));
        let values = shown.as_ref().and_then(|(layer, map)| {
            Histogram::of_view(&self.textures, &displayed.renderer, (*layer, map), &pose, sizes, free)
        });
        let range = values.and_then(|values| self.automatic_range(shown?.0, &values));
        range.into_iter().for_each(|range| self.set_range(layer, range));
    }

    fn set_range(&mut self, layer: usize, range: [f32; 2]) {
        let mut layers = self.settings.options.layers.clone();
        if layers.is_empty() {
            layers.push(LayerOptions::default());
        }
        if let Some(options) = layers.get_mut(layer).filter(|options| options.range != Some(range)) {
            options.range = Some(range);
            self.show_layers(layers);
        }
    }

    /// Makes the layer that the panel changes lighter by so many stops, and says how light it is.
    pub(in super::super) fn expose(&mut self, stops: f32) {
        if self.display.displayed().is_none() {
            return;
        }
        let (layer, mut layers) = (self.panel.display.layer(), self.settings.options.layers.clone());
        if layers.is_empty() {
            layers.push(LayerOptions::default());
        }
        let Some(options) = layers.get_mut(layer) else { return };
        options.exposure = (options.exposure + stops).clamp(-MOST_STOPS, MOST_STOPS);
        let exposure = options.exposure;
        self.show_layers(layers);
        self.notify_in_title(&format!("exposure: {exposure:+} stops"));
    }

    /// The range of a layer by the values in view.
    fn automatic_range(&self, layer: vastex::LayerId, values: &Histogram) -> Option<[f32; 2]> {
        let described = self.textures.texture(layer.texture()).ok()?.description();
        let format = described.layers.get(layer.index())?.format;
        self.panel.display.automatic_range(values, StoredScale::new(format))
    }
}
