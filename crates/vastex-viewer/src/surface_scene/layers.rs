//! What of the sources in a window is shown, and how: its layers, those of sources that lie over it, and
//! how they are compared.

use std::time::Duration;

use super::SurfaceScene;
use super::displayed::DisplaySettings;
use super::source::{DisplayError, PreparedSource};
use crate::layers::{CompareMode, Layers};
use crate::panels::PanelTexture;
use crate::surface::{DisplayOptions, LayerOptions, PlanetOptions};
use crate::view_text::ViewText;

impl SurfaceScene {
    /// What the panel is told of the textures that are displayed.
    pub(super) fn panel_textures(&self) -> Option<Vec<PanelTexture>> {
        let texture = |texture| {
            let shown = self.textures.texture(texture).ok()?;
            let name = shown.name().unwrap_or_default().to_owned();
            Some(PanelTexture { name, layers: shown.description().layers.clone() })
        };
        self.display.displayed()?.textures().into_iter().map(texture).collect()
    }

    /// Displays layers otherwise. Where that cannot be, it is said, and all stays as it was.
    pub(super) fn show_layers(&mut self, layers: Vec<LayerOptions>) {
        self.show_options(DisplayOptions { layers, ..self.settings.options.clone() });
    }

    /// Shows layers as options say, or says why that cannot be; then all stays as it was.
    pub(super) fn show_options(&mut self, options: DisplayOptions) {
        self.finish_taking_over();
        let settings = DisplaySettings { options, ..self.settings.clone() };
        let shown = match self.display.displayed_mut() {
            Some(displayed) => displayed.show_layers(&self.gpu, &mut self.textures, &settings),
            None => Ok(()),
        };
        match shown {
            Ok(()) => {
                self.settings = settings;
                self.beside.forget("layers");
            }
            Err(error) => self.report_error("layers", &error.to_string()),
        }
        self.wake();
    }

    /// Displays what a view says, in its scene. Where that cannot be, it is said, and all stays as it was.
    /// Returns true if it is displayed.
    pub fn show_view(&mut self, view: &ViewText) -> bool {
        self.finish_taking_over();
        let mut settings = self.settings.clone();
        view.change(&mut settings.options);
        // What a text says nothing of is as `render --view` has it: no range of the values takes its place.
        if view.names_layers() && settings.range_is_free {
            settings
                .options
                .layers
                .iter_mut()
                .for_each(|layer| layer.range = layer.range.or(Some([0.0, 1.0])));
        }
        (settings.scene, settings.overlay) = (view.scene(settings.scene), view.overlay(settings.overlay));
        let Some(displayed) = self.display.displayed_mut() else { return false };
        let count = displayed.textures().len();
        if let Some(texture) = view.textures().find(|texture| *texture >= count) {
            self.report_error("view", &format!("the view is of file {}, and {count} are open", texture + 1));
            return false;
        }
        let is_other = (&settings.options, settings.scene, settings.overlay)
            != (&self.settings.options, self.settings.scene, self.settings.overlay);
        if is_other && let Err(error) = displayed.put_on(&self.gpu, &mut self.textures, &settings) {
            self.report_error("view", &error.to_string());
            return false;
        }
        self.beside.forget("view");
        self.settings = settings;
        self.values = None;
        true
    }

    /// Lights the planet otherwise, or shows other parts of it.
    pub(super) fn light_planet(&mut self, planet: PlanetOptions) {
        self.finish_taking_over();
        let before = std::mem::replace(&mut self.settings.options.planet, planet);
        let PlanetOptions { night, clouds, light } = &self.settings.options.planet;
        let is_other = (night, clouds) != (&before.night, &before.clouds);
        if let Some(displayed) = self.display.displayed_mut() {
            displayed.renderer.set_light(*light);
        }
        if is_other {
            self.show_layers(self.settings.options.layers.clone());
        }
        self.wake();
    }

    /// Lays another source over what is displayed: the layers of it that files are displayed with at first
    /// ([`super::FirstDisplay`]), else its first one, over all others.
    pub fn lay_over(&mut self, name: &str, source: PreparedSource) -> Result<(), DisplayError> {
        self.finish_taking_over();
        let Some(displayed) = self.display.displayed() else { return Ok(()) };
        let count = displayed.textures().len();
        let mut settings = self.settings.clone();
        if !settings.options.is_of_planet(count) {
            let asked = self.beside.chosen.filtered(self.first_layers.clone(), 0);
            let layers = with_another(&settings.options.layers, &asked, count);
            settings.options.layers = self.beside.chosen.filtered(layers, count + 1);
        }
        let Some(displayed) = self.display.displayed_mut() else { return Ok(()) };
        displayed.lay_over(&self.gpu, &mut self.textures, &settings, (name, source))?;
        displayed.name = format!("{} + {name}", displayed.name);
        self.settings = settings;
        self.change_pools_again();
        self.minimaps.clear();
        self.wake();
        Ok(())
    }

    /// The next way of comparing the uppermost layer with those beneath it.
    pub fn compare_next(&mut self) {
        if self.comparable().is_none() {
            self.beside.notify("one layer is shown; lay a file over it in the panel (M), or with --over");
            return;
        }
        let next = self.settings.options.compare_mode.next();
        self.settings.options.compare_mode = next;
        self.jumped();
        self.beside.notify(&format!("compare: {}", next.name()));
        self.wake();
    }

    /// How layers are to be compared now.
    pub(super) fn compared(&self) -> CompareMode {
        self.settings.options.compare_mode.at(self.beside.now())
    }

    /// Has layers compared as they are to be seen now.
    pub(super) fn compare(&mut self) {
        let mode = self.compared();
        if let Some(displayed) = self.display.displayed_mut() {
            displayed.compare(&self.gpu, &self.textures, mode);
        }
    }

    /// The layers that are displayed, if two of them or more are seen.
    pub(super) fn comparable(&self) -> Option<&Layers> {
        Some(self.display.displayed()?.renderer.layers()).filter(|layers| layers.can_compare())
    }

    /// After what time layers are to be seen otherwise than now, if they are compared so.
    pub(super) fn flickers_in(&self) -> Option<Duration> {
        let mode: CompareMode = self.settings.options.compare_mode;
        self.comparable().and_then(|_| mode.changes_after(self.beside.now()))
    }

    /// The layers that are shown, where nobody has chosen any the first of each texture.
    pub(super) fn layers_or_first(&self) -> Vec<LayerOptions> {
        let chosen = self.settings.options.layers.clone();
        let count = self.display.displayed().map_or(0, |displayed| displayed.textures().len());
        if chosen.is_empty() { (0..count).map(LayerOptions::first_of).collect() } else { chosen }
    }

    /// Gives layers their first range that have none and that nobody said anything of.
    pub(super) fn look_for_first_ranges(&mut self) {
        // What waits behind its preview is of the same values.
        let is_alone = self.display.next().is_none() && self.settings.range_is_free;
        let Some(displayed) = self.display.displayed().filter(|_| is_alone) else { return };
        let (before, now) = (self.layers_or_first(), self.beside.now());
        let found = self.first_ranges.look((self.layers_of, now), (&self.textures, displayed), &before);
        let Some((layers, said)) = found else { return };
        if layers != before {
            self.show_layers(layers);
        }
        said.iter().for_each(|said| self.announce(said));
    }
}

/// The layers that are shown once a texture more is there, after `count` others: as the command line has
/// them, `asked`, where nobody has changed that, else those of the new one over all others.
fn with_another(shown: &[LayerOptions], asked: &[LayerOptions], count: usize) -> Vec<LayerOptions> {
    let asked_of = |count: usize| asked.iter().filter(move |layer| layer.texture < count).cloned();
    let of_new: Vec<LayerOptions> = asked.iter().filter(|layer| layer.texture == count).cloned().collect();
    if !of_new.is_empty() && asked_of(count).eq(shown.iter().cloned()) {
        return asked_of(count + 1).collect();
    }
    let before =
        if shown.is_empty() { (0..count).map(LayerOptions::first_of).collect() } else { shown.to_vec() };
    let new = if of_new.is_empty() { vec![LayerOptions::first_of(count)] } else { of_new };
    before.into_iter().chain(new).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_of_another_texture_come_where_the_command_line_has_them_else_over_all_others() {
        let layer = |texture, opacity| LayerOptions { texture, opacity, ..LayerOptions::default() };
        let asked = [layer(1, 0.25), layer(0, 0.5)];
        assert_eq!(with_another(&asked[1..], &asked, 1), asked);
        let changed = [layer(0, 0.75)];
        assert_eq!(with_another(&changed, &asked, 1), [layer(0, 0.75), layer(1, 0.25)]);
        assert_eq!(with_another(&asked, &asked, 2), [layer(1, 0.25), layer(0, 0.5), layer(2, 1.0)]);
        assert_eq!(with_another(&[], &[], 1), [layer(0, 1.0), layer(1, 1.0)]);
    }
}
