//! The values in view: for the panel, and for ranges that are by them.

use std::time::Duration;

use vastex::LayerId;

use super::SurfaceScene;
use super::displayed::Displayed;
use crate::camera::Pose;
use crate::inspect::Histogram;
use crate::layers::StoredScale;
use crate::surface::{LayerOptions, MOST_STOPS};

/// Between two looks at the values of a view that changes.
const EVERY: Duration = Duration::from_millis(300);

/// Values that are in view.
pub(super) struct Values {
    /// `None` if no part of the image is in view.
    pub(super) histogram: Option<Histogram>,
    /// Of which of the shown layers.
    layer: usize,
    taken_at: Duration,
    /// True if they are those of a view that had settled.
    are_last: bool,
}

impl Values {
    /// The view is another than the one that the values are of.
    pub(super) fn age(&mut self) {
        self.are_last = false;
    }
}

impl SurfaceScene {
    /// Looks at the values in view while the panel shows them, no more often than they are of use.
    pub(super) fn look_at_values(&mut self, pose: Pose) {
        let Some(displayed) = self.display.displayed().filter(|_| self.beside.panel.is_open()) else {
            return;
        };
        let (layer, now) = (self.beside.panel.display.layer(), self.beside.now());
        let is_settled = self.is_settled(&self.textures.stats());
        let is_due = self.values.as_ref().is_none_or(|values| {
            let is_old = now.saturating_sub(values.taken_at) >= EVERY;
            values.layer != layer || if is_settled { !values.are_last } else { is_old }
        });
        if !is_due {
            return;
        }
        let found = self.values_of(displayed, layer, &pose);
        let range = found.as_ref().filter(|_| self.beside.panel.display.follows());
        let range = range.and_then(|(layer, values)| self.automatic_range(*layer, values));
        let histogram = found.map(|(_, values)| values);
        self.values = Some(Values { histogram, layer, taken_at: now, are_last: is_settled });
        let unsettled = self.unsettled;
        if let Some(range) = range {
            self.set_range(layer, range);
        }
        // The pages that are wanted are the same.
        self.unsettled = unsettled;
    }

    /// Makes black and white of the layer that the panel changes what they are by the values in view.
    pub fn set_automatic_range(&mut self, pose: Pose) {
        let Some(displayed) = self.display.displayed() else { return };
        let layer = self.beside.panel.display.layer();
        let found = self.values_of(displayed, layer, &pose);
        if found.is_none() && !displayed.is_whole() {
            return self.beside.notify("nothing of the image is there yet where the view is");
        }
        let range = found.and_then(|(layer, values)| self.automatic_range(layer, &values));
        range.into_iter().for_each(|range| self.set_range(layer, range));
    }

    /// The values in view of one of the shown layers, and which layer of which texture that is; `None` if no
    /// part of the image is in view.
    fn values_of(&self, displayed: &Displayed, layer: usize, pose: &Pose) -> Option<(LayerId, Histogram)> {
        let shown = displayed.renderer.layers().iter().nth(layer)?;
        let (sizes, free) = ((self.size(), displayed.size), Some(self.free()));
        let of = (shown.layer, &shown.color_map);
        let values = Histogram::of_view(&self.textures, &displayed.renderer, of, pose, sizes, free)?;
        Some((shown.layer, values))
    }

    fn set_range(&mut self, layer: usize, range: [f32; 2]) {
        self.change_layer(layer, |options| options.range.replace(range) != Some(range));
    }

    /// Changes how one of the shown layers is displayed, where `change` says that it did.
    fn change_layer(&mut self, layer: usize, change: impl FnOnce(&mut LayerOptions) -> bool) {
        let mut layers = self.settings.options.layers.clone();
        if layers.is_empty() {
            layers.push(LayerOptions::default());
        }
        if layers.get_mut(layer).is_some_and(change) {
            self.show_layers(layers);
        }
    }

    /// Makes the layer that the panel changes lighter by so many stops, and says how light it is.
    pub fn expose(&mut self, stops: f32) {
        if self.display.displayed().is_none() {
            return;
        }
        let mut exposure = None;
        self.change_layer(self.beside.panel.display.layer(), |options| {
            options.exposure = (options.exposure + stops).clamp(-MOST_STOPS, MOST_STOPS);
            exposure = Some(options.exposure);
            true
        });
        if let Some(exposure) = exposure {
            self.beside.notify(&format!("exposure: {exposure:+} stops"));
        }
    }

    /// The range of a layer by the values in view.
    fn automatic_range(&self, layer: LayerId, values: &Histogram) -> Option<[f32; 2]> {
        let described = self.textures.texture(layer.texture()).ok()?.description();
        let format = described.layers.get(layer.index())?.format;
        self.beside.panel.display.automatic_range(values, StoredScale::new(format))
    }
}
