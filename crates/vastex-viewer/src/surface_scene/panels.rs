//! The panel in a window, and what lies over the picture: what they are told of what is displayed, and what
//! becomes of what a person changes in them.

use egui::{Rect, Ui};
use glam::DVec2;

use super::SurfaceScene;
use super::guided::Guided;
use super::values::Values;
use crate::camera::Pose;
use crate::panels::{Bookmark, ImageView, Minimap, ShownTextures, WindowAsked, WindowStatus, swipe_line};
use crate::scene::Scene;
use crate::surface::DisplayOptions;

/// Points that the titles of panes take at the top.
const TITLES: f32 = 32.0;

/// The corners of a part of the window, in whole pixels.
fn corners_of(part: Rect, pixels_per_point: f32) -> [DVec2; 2] {
    [part.min, part.max]
        .map(|corner| (DVec2::new(corner.x.into(), corner.y.into()) * f64::from(pixels_per_point)).round())
}

impl SurfaceScene {
    /// Shows the panel and what lies over the picture for the frame that comes, and displays what was changed
    /// in them. `recent` are paths of files that were opened lately, the last one first, `bookmarks` views of
    /// this one. The host has egui run what it is handed, once or several times, by `run`.
    pub fn show_panels(
        &mut self,
        pose: Pose,
        (recent, bookmarks): (&[String], &[Bookmark]),
        run: impl FnOnce(&mut dyn FnMut(&mut Ui)),
    ) {
        let now = self.beside.now();
        self.beside.title.expire(now);
        // What lies over the picture is where the picture has it, and a person may change how it is compared.
        self.compare();
        self.look_for_first_ranges();
        self.look_at_values(pose);
        let is_settled = self.is_settled(&self.textures.stats());
        let name = self.name().to_owned();
        let shown = self.panel_textures();
        let hud_data = self.hud_data();
        let mut options = self.settings.options.layers.clone();
        let mut compare_mode = self.settings.options.compare_mode;
        let mut placement = self.settings.options.placement;
        let can_place =
            self.display.displayed().is_some_and(|source| source.can_place(&self.textures, &self.settings));
        let mut planet = self.settings.options.planet.clone();
        let (mut asked, mut is_changed) = (Vec::new(), false);
        let histogram = self.values.as_ref().and_then(|values| values.histogram.as_ref());
        let (panes, pointer) = (self.panes(), self.pointer);
        let below = self.line_below(&pose);
        self.below.show(below.clone(), now);
        let titles = self.pane_titles(&panes, &pose);
        let view = ImageView { pose, picture: self.size(), image: self.image_size(), left: panes.left };
        let (settings, textures) = (&self.settings, &self.textures);
        let beside = &mut self.beside;
        let panel = &mut beside.panel;
        // An overlay is no picture of texels.
        let guided = self.display.displayed().filter(|source| source.overlay.is_none());
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
        let (opening, notice) = (beside.opening.as_ref(), beside.title.notice());
        beside.shown_notice = notice.map(str::to_owned);
        let (minimaps, is_hidden) = (&mut self.minimaps, beside.is_hidden);
        minimaps.resize_with(panes.count as usize, Minimap::default);
        let (hud, mut hud_changes) = (&mut beside.hud.panel, Vec::new());
        let messages = &mut beside.messages;
        run(&mut |ui| {
            if panel.leaves_room_beside(ui, hud_data.is_some())
                && let Some(data) = &hud_data
            {
                hud_changes = hud.show(ui, data);
            }
            let texture = shown.as_ref().map(|textures| ShownTextures {
                textures,
                shown: &mut options,
                compare_mode: &mut compare_mode,
                placement: can_place.then_some(&mut placement),
                histogram,
            });
            let mut told = WindowStatus {
                name: &name,
                opening: opening.map(|(name, share)| (&**name, *share)),
                notice,
                below: below.as_deref(),
                panes: panes.count,
                scene: settings.scene,
                position: (pose, view.image),
                texel_size,
                map,
                images,
                bands,
                planet: (settings.scene == Scene::Planet).then_some(&mut planet),
                rows,
                texture,
                recent,
                bookmarks,
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
                    asked.extend(guided.show(ui, pane, free(pane), minimap).map(WindowAsked::Go));
                }
            }
            // What is measured, and what panes are called, is read over values of texels and a map.
            if let Some(measure) = panel.measure.as_ref().filter(|_| guided.is_some()) {
                for pane in seen() {
                    let view = ImageView { left: panes.first(pane), ..view };
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
        self.beside.asked.extend(asked);
        if self.beside.panel.free != free_before {
            // All of an image is somewhere else in the next frame, and other values are in view.
            self.unsettled = self.unsettled.max(1);
            self.values.iter_mut().for_each(Values::age);
            self.minimaps.iter_mut().for_each(Minimap::age);
        }
        if self.beside.panel.display != before {
            // Another layer's values, or others of them, count from the next frame on.
            self.values = None;
            self.wake();
        }
        if std::mem::replace(&mut self.settings.options.compare_mode, compare_mode) != compare_mode {
            // Panes show other parts of the image than one picture.
            self.wake();
        }
        if self.settings.options.placement != placement {
            self.show_options(DisplayOptions { placement, ..self.settings.options.clone() });
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
        self.compare();
        self.look_beside_panels();
    }
}
