//! How layers become colours, for a person to change: which are shown, and of each its range, curve, exponent, colour map and opacity.

use egui::{Button, ComboBox, DragValue, RichText, Slider, SliderClamping, Ui};
use vastex::Layer;

use super::shades::shades;
use crate::inspect::{Histogram, StoredScale};
use crate::layers::{ColorMap, Curve, MOST_LAYERS, Palette, Tone};
use crate::surface::LayerOptions;

/// The share of the values in view, in percent, that is left out at each end by the automatic range of the first click.
const CLIPPED: f64 = 0.5;

/// What is shown of a texture, as far as the panel goes by it.
#[derive(Debug)]
pub struct ShownTexture<'a> {
    /// The layers that the texture has.
    pub layers: &'a [Layer],
    /// Those that are shown, the lowest first, for the panel to change; the first one of the texture where there is none.
    pub shown: &'a mut Vec<LayerOptions>,
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
    /// Whether the range follows what is in view.
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

    /// Whether the range of the layer follows what is in view, so that a new histogram changes it.
    pub fn follows(&self) -> bool {
        self.follows
    }

    /// The range that leaves the outermost values in view out, in what shaders sample; nothing where there are no values.
    pub fn automatic_range(&self, histogram: &Histogram, scale: StoredScale) -> Option<[f32; 2]> {
        let clipped = self.clipped / 100.0;
        let [low, high] = histogram.between(clipped, 1.0 - clipped)?;
        let stored = distinct([scale.stored(low), scale.stored(high)], scale);
        Some(stored.map(|value| scale.sampled(value)))
    }

    /// Shows the panel. Says whether anything of [`ShownTexture::shown`] is another than before.
    pub fn show(&mut self, ui: &mut Ui, texture: &mut ShownTexture<'_>) -> bool {
        let ShownTexture { layers, shown, histogram } = texture;
        let before = shown.clone();
        if shown.is_empty() {
            shown.push(LayerOptions::default());
        }
        self.selected = self.selected.min(shown.len() - 1);
        if layers.len() > 1 {
            let before = (self.selected, shown.len());
            self.list(ui, layers, shown);
            // What follows is one layer.
            self.follows &= before == (self.selected, shown.len());
        }
        let options = &mut shown[self.selected];
        let described = |layer: &&Layer| options.name.as_ref().is_none_or(|name| *name == layer.name);
        if let Some(layer) = layers.iter().find(described) {
            self.layer_controls(ui, layer, options, *histogram);
        }
        // A texture of which nothing is chosen is shown as one without a choice.
        let is_plain = shown.len() == 1 && shown[0] == LayerOptions::default();
        if is_plain && before.is_empty() {
            shown.clear();
        }
        **shown != before
    }

    /// The layers that are shown, the uppermost first, one of which is selected.
    fn list(&mut self, ui: &mut Ui, layers: &[Layer], shown: &mut Vec<LayerOptions>) {
        let name_of = |options: &LayerOptions| {
            options.name.clone().or_else(|| Some(layers.first()?.name.clone())).unwrap_or_default()
        };
        let (mut gone, mut raised) = (None, None);
        let count = shown.len();
        for (n, options) in shown.iter_mut().enumerate().rev() {
            ui.horizontal(|ui| {
                ui.checkbox(&mut options.is_visible, format!("show {}", n + 1));
                if ui.selectable_label(n == self.selected, name_of(options)).clicked() {
                    self.selected = n;
                }
                if n + 1 < count && ui.small_button(format!("Move {} up", n + 1)).clicked() {
                    raised = Some(n);
                }
                if count > 1 && ui.small_button(format!("Remove {}", n + 1)).clicked() {
                    gone = Some(n);
                }
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
            ComboBox::from_label("Layer").selected_text(name_of(selected)).show_ui(ui, |ui| {
                for layer in layers {
                    let is_this = name_of(selected) == layer.name;
                    if ui.selectable_label(is_this, &layer.name).clicked() && !is_this {
                        // Another layer has other values.
                        *selected = LayerOptions {
                            name: Some(layer.name.clone()),
                            opacity: selected.opacity,
                            ..LayerOptions::default()
                        };
                    }
                }
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
        ui.separator();
    }

    fn layer_controls(
        &mut self,
        ui: &mut Ui,
        layer: &Layer,
        options: &mut LayerOptions,
        histogram: Option<&Histogram>,
    ) {
        let scale = StoredScale::new(layer.format);
        let color_map = ColorMap::new(layer, options.range).with_palette(options.palette);
        let tone = Tone { curve: options.curve, gamma: options.gamma, ..color_map.tone() };
        let mut range = color_map.tone().range.map(|value| scale.stored(value));
        let mut is_changed = shades(ui, histogram, scale, &color_map.with_tone(tone), &mut range);
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
                .on_hover_text("range, curve, gamma and colour map as at first")
                .clicked()
            {
                *options = LayerOptions {
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
        ui.horizontal(|ui| {
            ui.label("Curve");
            for curve in Curve::ALL {
                ui.selectable_value(&mut options.curve, curve, curve.name());
            }
        });
        ui.add(
            Slider::new(&mut options.gamma, 0.1..=10.0)
                .logarithmic(true)
                .clamping(SliderClamping::Never)
                .text("Gamma"),
        );
        if color_map.takes_palette() {
            let box_of = ComboBox::from_label("Colour map").selected_text(options.palette.name());
            box_of.show_ui(ui, |ui| {
                for palette in Palette::ALL {
                    ui.selectable_value(&mut options.palette, palette, palette.name());
                }
            });
        }
        let read = |value: f64| match scale.most() {
            Some(_) => format!("{value:.0}"),
            None => format!("{value:.5}"),
        };
        let extent =
            histogram.and_then(Histogram::extent).map(|extent| extent.map(|value| read(scale.stored(value))));
        let text = match extent {
            Some([low, high]) if histogram.is_some_and(Histogram::is_of_view) => {
                format!("values in view: {low} to {high}")
            }
            Some([low, high]) => format!("values of all of it: {low} to {high}"),
            None => "no values are known yet".to_owned(),
        };
        ui.label(RichText::new(text).weak());
    }
}

/// The same values, the second moved where they are equal, since black and white must not be.
fn distinct([low, high]: [f64; 2], scale: StoredScale) -> [f64; 2] {
    // What two floats of their size can tell apart, whatever the scale makes of them.
    let least = scale.most().map_or_else(|| low.abs().max(1e-30) * 1e-5, |_| 1.0);
    if (high - low).abs() < least { [low, low + least] } else { [low, high] }
}

#[cfg(test)]
mod tests;
