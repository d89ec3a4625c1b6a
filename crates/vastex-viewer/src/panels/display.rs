//! How layers become colours, for a person to change: which are shown, and of each its range, exposure,
//! curve, exponent, colour map and opacity.

use egui::{Button, ComboBox, DragValue, RichText, Slider, SliderClamping, Ui};
use vastex::Layer;

use super::compare::{compare_controls, placement_controls};
use super::palettes::palette_controls;
use super::shades::shades;
use crate::inspect::{Histogram, float_text};
use crate::layers::{Bands, CompareMode, Curve, MOST_LAYERS, Nodata, Placement, StoredScale};
use crate::surface::{LayerOptions, MOST_STOPS};

/// The share of the values in view, in percent, that is left out at each end by the automatic range of the
/// first click.
const CLIPPED: f64 = 0.5;

/// The first colour of what is without data that a person is offered: one that few pictures have.
const FIRST_NODATA_COLOR: [u8; 3] = [255, 0, 255];

/// A texture that is shown.
#[derive(Clone, Debug)]
pub struct PanelTexture {
    /// What a person knows it by.
    pub name: String,
    /// The layers that it has.
    pub layers: Vec<Layer>,
}

/// What is shown, as far as the panel goes by it.
#[derive(Debug)]
pub struct ShownTextures<'a> {
    /// The textures that are shown together, the lowest first; [`LayerOptions::texture`] counts them.
    pub textures: &'a [PanelTexture],
    /// The layers that are shown, the lowest first, for the panel to change; the first one of each texture
    /// where there is none.
    pub shown: &'a mut Vec<LayerOptions>,
    /// How the uppermost of them is compared with those beneath it, for the panel to change.
    pub compare_mode: &'a mut CompareMode,
    /// The place of images of unlike size, for the panel to change; `None` where there are none.
    pub placement: Option<&'a mut Placement>,
    /// The values of [`DisplayPanel::layer`] that are in view, if they are known.
    pub histogram: Option<&'a Histogram>,
}

/// How layers are displayed. The same panel goes on from frame to frame.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayPanel {
    /// Which of the shown layers is changed.
    selected: usize,
    /// The share of the values in view, in percent, that the automatic range leaves out at each end.
    clipped: f64,
    /// True if the range follows what is in view.
    follows: bool,
}

impl Default for DisplayPanel {
    fn default() -> DisplayPanel {
        DisplayPanel { selected: 0, clipped: CLIPPED, follows: false }
    }
}

impl DisplayPanel {
    /// Which of the shown layers it changes, and so whose values the histogram is to be of.
    pub fn layer(&self) -> usize {
        self.selected
    }

    /// Returns true if the range of the layer follows what is in view, so that a new histogram changes it.
    pub fn follows(&self) -> bool {
        self.follows
    }

    /// The range that leaves the outermost values in view out, in what shaders sample; `None` if there are no
    /// values.
    pub fn automatic_range(&self, histogram: &Histogram, scale: StoredScale) -> Option<[f32; 2]> {
        let clipped = self.clipped / 100.0;
        let [low, high] = histogram.between(clipped, 1.0 - clipped)?;
        let stored = distinct([scale.stored(low), scale.stored(high)], scale);
        Some(stored.map(|value| scale.sampled(value)))
    }

    /// Shows the panel. Returns true if anything of [`ShownTextures::shown`],
    /// [`ShownTextures::compare_mode`] or [`ShownTextures::placement`] is another than before.
    pub fn show(&mut self, ui: &mut Ui, told: &mut ShownTextures<'_>) -> bool {
        let ShownTextures { textures, shown, compare_mode, placement, histogram } = told;
        let before = (shown.clone(), **compare_mode, placement.as_deref().copied());
        let first_of = |texture| LayerOptions { texture, ..LayerOptions::default() };
        let plain: Vec<LayerOptions> = (0..textures.len().max(1)).map(first_of).collect();
        if shown.is_empty() {
            shown.clone_from(&plain);
        }
        self.selected = self.selected.min(shown.len() - 1);
        if textures.iter().map(|texture| texture.layers.len()).sum::<usize>() > 1 {
            let before = (self.selected, shown.len());
            self.list(ui, textures, shown);
            if shown.len() > 1 {
                compare_controls(ui, compare_mode);
                placement.iter_mut().for_each(|placement| placement_controls(ui, placement));
            }
            ui.separator();
            // What follows is one layer.
            self.follows &= before == (self.selected, shown.len());
        }
        let options = &mut shown[self.selected];
        if let Some(layer) = described(textures, options) {
            self.layer_controls(ui, layer, options, *histogram);
        }
        // Textures of which nothing is chosen are shown as those without a choice.
        if **shown == plain && before.0.is_empty() {
            shown.clear();
        }
        (&**shown, **compare_mode, placement.as_deref().copied()) != (&before.0, before.1, before.2)
    }

    /// The layers that are shown, the uppermost first, one of which is selected.
    fn list(&mut self, ui: &mut Ui, textures: &[PanelTexture], shown: &mut Vec<LayerOptions>) {
        let name_of = |options: &LayerOptions| {
            let layer = described(textures, options).map_or("", |layer| &layer.name);
            name_in(textures, options.texture, layer)
        };
        let (mut gone, mut raised) = (None, None);
        let count = shown.len();
        for (n, options) in shown.iter_mut().enumerate().rev() {
            ui.horizontal(|ui| {
                ui.checkbox(&mut options.is_visible, format!("show {}", n + 1));
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if count > 1 && ui.small_button(format!("Remove {}", n + 1)).clicked() {
                        gone = Some(n);
                    }
                    if n + 1 < count && ui.small_button(format!("Move {} up", n + 1)).clicked() {
                        raised = Some(n);
                    }
                    // What is left of the row, and no more.
                    let name = name_of(options);
                    let label = Button::selectable(n == self.selected, name.as_str()).truncate();
                    if ui.add(label).on_hover_text(name).clicked() {
                        self.selected = n;
                    }
                });
            });
        }
        if let Some(n) = raised {
            shown.swap(n, n + 1);
            self.selected = n + 1;
        }
        if let Some(n) = gone {
            shown.remove(n);
            self.selected -= usize::from(n < self.selected);
            self.selected = self.selected.min(shown.len() - 1);
        }
        let selected = &mut shown[self.selected];
        let mut added = None;
        ui.horizontal(|ui| {
            ui.scope(|ui| {
                // However long names are, the button beside it stays in the panel.
                ui.set_max_width(150.0);
                let choice = ComboBox::from_label("Layer").width(150.0).truncate();
                choice
                    .selected_text(name_of(selected))
                    .show_ui(ui, |ui| layer_choice(ui, textures, selected));
            });
            if count < MOST_LAYERS && ui.button("Add a layer").clicked() {
                added = Some(LayerOptions { opacity: 0.5, ..selected.clone() });
            }
        });
        if let Some(added) = added {
            shown.push(added);
            self.selected = shown.len() - 1;
        }
        ui.add(Slider::new(&mut shown[self.selected].opacity, 0.0..=1.0).text("Opacity"));
    }

    fn layer_controls(
        &mut self,
        ui: &mut Ui,
        layer: &Layer,
        options: &mut LayerOptions,
        histogram: Option<&Histogram>,
    ) {
        let scale = StoredScale::new(layer.format);
        let color_map = options.color_map(layer);
        let mut range = color_map.tone().range.map(|value| scale.stored(value));
        let mut is_changed = shades(ui, histogram, scale, &color_map, &mut range);
        ui.horizontal_wrapped(|ui| {
            let speed = ((range[1] - range[0]).abs() / 200.0).max(scale.most().map_or(1e-9, |_| 0.25));
            for (name, value) in ["Black", "White"].into_iter().zip(&mut range) {
                let label = ui.label(name);
                let mut drag = DragValue::new(value).speed(speed).range(-1e37..=1e37);
                if scale.most().is_some() {
                    drag = drag.fixed_decimals(0);
                }
                is_changed |= ui.add(drag).labelled_by(label.id).changed();
            }
            if ui
                .button("Reset display")
                .on_hover_text("range, exposure, curve, gamma, colour map, bands and no data as at first")
                .clicked()
            {
                *options = LayerOptions {
                    texture: options.texture,
                    name: options.name.clone(),
                    opacity: options.opacity,
                    is_visible: options.is_visible,
                    filter: options.filter,
                    ..LayerOptions::default()
                };
                (self.follows, is_changed) = (false, false);
            }
        });
        if is_changed {
            self.follows = false;
            let [black, white] = distinct(range, scale).map(|value| scale.sampled(value));
            // No number is too large or too small to be divided by.
            if (1.0 / (white - black)).is_normal() {
                options.range = Some([black, white]);
            }
        }
        ui.horizontal_wrapped(|ui| {
            let automatic = histogram.and_then(|histogram| self.automatic_range(histogram, scale));
            let button = ui.add_enabled(automatic.is_some(), Button::new("Range from view"));
            if button.on_hover_text("black and white by the values in view: C").clicked() {
                options.range = automatic;
            }
            let drag = DragValue::new(&mut self.clipped).range(0.0..=20.0).speed(0.05).suffix(" %");
            let drag = ui.add(drag.max_decimals(2));
            let label = ui.label("left out at each end");
            drag.labelled_by(label.id);
        });
        ui.checkbox(&mut self.follows, "Follow the view while this panel is open");
        let exposure = Slider::new(&mut options.exposure, -10.0..=10.0).clamping(SliderClamping::Never);
        ui.add(exposure.step_by(0.1).max_decimals(2).suffix(" stops").text("Exposure"))
            .on_hover_text("a stop more doubles what lies above black: [ and ]");
        options.exposure = options.exposure.clamp(-MOST_STOPS, MOST_STOPS);
        ComboBox::from_label("Curve").selected_text(options.curve.name()).show_ui(ui, |ui| {
            for curve in Curve::ALL {
                let choice = ui.selectable_value(&mut options.curve, curve, curve.name());
                choice.on_hover_text(meaning(curve));
            }
        });
        ui.add(
            Slider::new(&mut options.gamma, 0.1..=10.0)
                .logarithmic(true)
                .clamping(SliderClamping::Never)
                .text("Gamma"),
        );
        if color_map.takes_palette() {
            palette_controls(ui, &mut options.palette);
        }
        band_controls(ui, layer.format.channels(), &mut options.bands);
        nodata_controls(ui, scale, layer, &mut options.nodata);
        if options.nodata.of(layer) != Nodata::None {
            nodata_color(ui, &mut options.nodata_color);
        }
        let read = |value: f64| match scale.most() {
            Some(_) => format!("{value:.0}"),
            None => float_text(value),
        };
        let extent =
            histogram.and_then(Histogram::extent).map(|extent| extent.map(|value| read(scale.stored(value))));
        let text = match extent {
            Some([low, high]) => format!("values in view: {low} to {high}"),
            None => "no values are known yet".to_owned(),
        };
        ui.label(RichText::new(text).weak());
    }
}

/// What a curve is for.
fn meaning(curve: Curve) -> &'static str {
    match curve {
        Curve::Linear => "values as they are",
        Curve::Log => "a hundredth of the range is a third of the shades",
        Curve::Light => "values are light; what is brighter than white is white",
        Curve::Reinhard => "values are light; up to eight times white is told apart",
        Curve::Aces => "values are light; bright light fades out as on film",
    }
}

/// Which of several channels are shown.
fn band_controls(ui: &mut Ui, channels: usize, bands: &mut Bands) {
    if channels < 2 {
        return;
    }
    let numbers = 0..channels as u8;
    let chosen = ComboBox::from_label("Bands").selected_text(bands.to_string());
    chosen.show_ui(ui, |ui| {
        let others = numbers.clone().map(Bands::One);
        let colors = (channels > 2).then_some([Bands::Color([0, 1, 2]), Bands::Color([2, 1, 0])]);
        for choice in [Bands::AsStored].into_iter().chain(others).chain(colors.into_iter().flatten()) {
            ui.selectable_value(bands, choice, choice.to_string());
        }
    });
    let Bands::Color(three) = bands else { return };
    ui.horizontal(|ui| {
        for (name, band) in ["Red", "Green", "Blue"].into_iter().zip(three) {
            let mut number = *band + 1;
            let label = ui.label(name);
            ui.add(DragValue::new(&mut number).range(1..=channels as u8).speed(0.05)).labelled_by(label.id);
            *band = number - 1;
        }
    });
}

/// Which value stands for no data: the layer's own, if it has one, until a person chooses another or none.
fn nodata_controls(ui: &mut Ui, scale: StoredScale, layer: &Layer, options: &mut Nodata) {
    let of_layer = Nodata::OfLayer.of(layer);
    let mut chosen = options.of(layer);
    let nodata = &mut chosen;
    ui.horizontal_wrapped(|ui| {
        let mut is_any = *nodata != Nodata::None;
        let hint = "what has this value is not drawn, or in a colour of its own, and counts in no range; its texels are not blended with others";
        if ui.checkbox(&mut is_any, "No data").on_hover_text(hint).changed() {
            *nodata = match (is_any, of_layer) {
                (false, _) => Nodata::None,
                (true, Nodata::None) => Nodata::Value(0.0),
                (true, of_layer) => of_layer,
            };
        }
        let is_float = scale.most().is_none();
        if let Nodata::Value(value) = nodata {
            let most = scale.most().unwrap_or(f64::from(f32::MAX));
            let least = if is_float { -most } else { 0.0 };
            let mut drag = DragValue::new(value).range(least..=most).clamp_existing_to_range(false);
            if !is_float {
                drag = drag.fixed_decimals(0);
            }
            let label = ui.label("is the value");
            ui.add(drag).labelled_by(label.id);
        }
        if is_float && is_any {
            let is_nan = *nodata == Nodata::NotANumber;
            if ui.selectable_label(is_nan, "is what is no number").clicked() {
                *nodata = if is_nan { Nodata::Value(0.0) } else { Nodata::NotANumber };
            }
        }
        if is_any && *nodata == of_layer {
            ui.label(RichText::new("as the file says").weak());
        }
    });
    *options = if chosen == of_layer { Nodata::OfLayer } else { chosen };
}

/// The colour of what is without data: none, as at first, or one that a person chooses.
fn nodata_color(ui: &mut Ui, color: &mut Option<[u8; 3]>) {
    ui.horizontal_wrapped(|ui| {
        let mut is_drawn = color.is_some();
        let label = ui.checkbox(&mut is_drawn, "Colour of no data");
        let hint = "where it has none, the background or the layer beneath is seen";
        if label.on_hover_text(hint).changed() {
            *color = is_drawn.then_some(FIRST_NODATA_COLOR);
        }
        if let Some(color) = color {
            let label = ui.label("red, green, blue");
            ui.color_edit_button_srgb(color).labelled_by(label.id);
        }
    });
}

/// The layers of all textures, of which a person may choose another.
fn layer_choice(ui: &mut Ui, textures: &[PanelTexture], selected: &mut LayerOptions) {
    let of = |(n, texture): (usize, &'_ PanelTexture)| -> Vec<(usize, String)> {
        texture.layers.iter().map(|layer| (n, layer.name.clone())).collect()
    };
    for (texture, layer) in textures.iter().enumerate().flat_map(of) {
        let described = described(textures, selected).map(|layer| &layer.name);
        let is_this = selected.texture == texture && described == Some(&layer);
        if ui.selectable_label(is_this, name_in(textures, texture, &layer)).clicked() && !is_this {
            // Another layer has other values.
            *selected = LayerOptions {
                texture,
                name: Some(layer),
                opacity: selected.opacity,
                ..LayerOptions::default()
            };
        }
    }
}

/// The layer that is meant.
fn described<'a>(textures: &'a [PanelTexture], options: &LayerOptions) -> Option<&'a Layer> {
    let is_meant = |layer: &&Layer| options.name.as_ref().is_none_or(|name| *name == layer.name);
    textures.get(options.texture)?.layers.iter().find(is_meant)
}

/// What a person knows a layer by: where there are several textures, by its texture's name as well, and by
/// that alone where it is the only layer of it.
fn name_in(textures: &[PanelTexture], texture: usize, layer: &str) -> String {
    match textures.get(texture) {
        Some(of) if textures.len() > 1 && of.layers.len() < 2 => of.name.clone(),
        Some(of) if textures.len() > 1 => format!("{}: {layer}", of.name),
        _ => layer.to_owned(),
    }
}

/// These values, the second moved where they are equal, since black and white must not be.
fn distinct([low, high]: [f64; 2], scale: StoredScale) -> [f64; 2] {
    // What two floats of their size can tell apart, whatever the scale makes of them.
    let least = scale.most().map_or_else(|| low.abs().max(1e-30) * 1e-5, |_| 1.0);
    if (high - low).abs() < least { [low, low + least] } else { [low, high] }
}

#[cfg(test)]
mod tests;
