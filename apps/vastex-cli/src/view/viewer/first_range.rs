//! Black and white of layers that are seen for the first time and that nobody has said anything of: heights
//! in metres and values of a sensor lie anywhere.

use std::time::Instant;

use vastex::LayerId;
use vastex_scenes::LayerOptions;
use vastex_viewer::layers::ColorMap;

use super::Viewer;
use super::panel::EVERY;
use crate::first_range::first_range;

/// Which of the textures that are displayed have their first range.
#[derive(Default)]
pub(super) struct FirstRanges {
    /// The opening that brought them.
    opening: u64,
    /// How many have it, the lowest ones.
    done: usize,
    /// What it is so far of a texture whose rows are yet to come, and when it was looked for.
    so_far: Option<[f32; 2]>,
    looked_at: Option<Instant>,
}

impl Viewer {
    /// Gives layers that have no range, and that nobody said anything of, the one of their values; those of a
    /// preview that grows one by the rows that are there. What a person chose meanwhile stays.
    pub(super) fn look_for_first_ranges(&mut self) {
        if self.first_ranges.opening != self.layers_of {
            self.first_ranges = FirstRanges { opening: self.layers_of, ..FirstRanges::default() };
        }
        // What waits behind its preview is of the same values.
        let Some(displayed) = self.display.displayed().filter(|_| self.display.next().is_none()) else {
            return;
        };
        let (count, now) = (displayed.textures().len(), Instant::now());
        let FirstRanges { done, so_far, looked_at, .. } = self.first_ranges;
        let is_early = !displayed.is_whole() && looked_at.is_some_and(|at| now.duration_since(at) < EVERY);
        if done >= count || is_early {
            return;
        }
        let (is_whole, rows) = (displayed.is_whole(), displayed.rows_there());
        let shown: Vec<(LayerId, ColorMap)> =
            displayed.renderer.layers().iter().map(|shown| (shown.layer, shown.color_map)).collect();
        let before = self.layers_or_first();
        let mut layers = before.clone();
        let mut said = None;
        if self.settings.range_is_free && rows > 0.0 {
            for (options, (layer, color_map)) in layers.iter_mut().zip(&shown) {
                let is_free =
                    options.texture >= done && options.range == so_far.filter(|_| options.texture == 0);
                let rows = if options.texture == 0 { rows } else { 1.0 };
                let found = is_free.then(|| first_range(&self.textures, (*layer, color_map), rows));
                if let Some((range, text)) = found.flatten() {
                    options.range = Some(range);
                    said = Some(text);
                }
            }
        }
        let first = |layers: &[LayerOptions]| layers.first().and_then(|layer| layer.range);
        self.first_ranges = FirstRanges {
            opening: self.layers_of,
            done: if is_whole { count } else { done },
            so_far: if layers != before { first(&layers) } else { so_far },
            looked_at: Some(now),
        };
        if layers != before {
            self.show_layers(layers);
        }
        if let Some(text) = said.filter(|_| is_whole) {
            self.notify(&text);
        }
    }
}
