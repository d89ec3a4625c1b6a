//! The first range of layers that are seen for the first time and that nobody has said anything of: heights
//! in metres and values of a sensor lie anywhere.

use std::time::Duration;

use vastex::{LayerId, Textures};

use super::displayed::Displayed;
use crate::inspect::first_range;
use crate::layers::ColorMap;
use crate::surface::LayerOptions;

/// Between two looks at the values of a preview that grows.
const EVERY: Duration = Duration::from_millis(300);

/// Which of the layers that were displayed have their first range.
#[derive(Default)]
pub(super) struct FirstRanges {
    /// The opening that brought them.
    opening: u64,
    found: Vec<Found>,
    /// When one was looked for last.
    looked_at: Option<Duration>,
}

/// What the first range of a layer is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    /// The texture, counted as [`LayerOptions::texture`] counts them, and the number of its layer.
    layer: (usize, usize),
    /// `None` where 0 and 1 are black and white.
    range: Option<[f32; 2]>,
    /// True if it is of all rows, and so the last word.
    is_last: bool,
}

impl FirstRanges {
    /// Gives layers of what is displayed that have no range, and that nobody said anything of, the one of
    /// their values; those of a preview that grows one by the rows that are there. What a person chose
    /// meanwhile stays; a layer that is chosen or reset later has its first range then.
    ///
    /// `opening` is the number of what brought the source, `layers` how its layers are displayed now, and
    /// `now` the time since the host began. Gives back how they are to be displayed, and what there is to say
    /// of that; `None` if no layer is due. Takes some milliseconds for each that is.
    pub(super) fn look(
        &mut self,
        (opening, now): (u64, Duration),
        (textures, displayed): (&Textures, &Displayed),
        layers: &[LayerOptions],
    ) -> Option<(Vec<LayerOptions>, Option<String>)> {
        if self.opening != opening {
            *self = FirstRanges { opening, ..FirstRanges::default() };
        }
        let (is_whole, rows) = (displayed.is_whole(), displayed.rows_there());
        let is_early =
            !is_whole && self.looked_at.is_some_and(|looked_at| now.saturating_sub(looked_at) < EVERY);
        if is_early || rows <= 0.0 {
            return None;
        }
        let shown: Vec<(LayerId, ColorMap)> =
            displayed.renderer.layers().iter().map(|shown| (shown.layer, shown.color_map)).collect();
        let numbers: Vec<usize> = shown.iter().map(|(layer, _)| layer.index()).collect();
        let is_due =
            |(options, &layer): (&LayerOptions, &usize)| self.is_due((options.texture, layer), options);
        if !layers.iter().zip(&numbers).any(is_due) {
            return None;
        }
        let mut given = layers.to_vec();
        let is_all_there = |texture: usize| is_whole || texture != 0;
        let said = self.give(&mut given, &numbers, is_all_there, |n| {
            let (layer, color_map) = shown.get(n)?;
            let rows = if layers[n].texture == 0 { rows } else { 1.0 };
            first_range(textures, (*layer, color_map), rows)
        });
        self.looked_at = Some(now);
        Some((given, said.filter(|_| is_whole)))
    }

    /// Returns true if values say what is black and white of a layer of a texture, where nobody else does.
    pub(super) fn has_range(&self, texture: usize) -> bool {
        self.found.iter().any(|found| found.layer.0 == texture && found.range.is_some())
    }

    /// Returns true if values have yet to say what is black and white of a layer, or have said it of a share
    /// of their rows, in what an opening brought.
    pub(super) fn is_due_in(&self, opening: u64, layer: &LayerOptions) -> bool {
        let of_texture = |found: &&Found| self.opening == opening && found.layer.0 == layer.texture;
        match self.found.iter().rfind(of_texture) {
            Some(found) if found.is_last => false,
            Some(found) => layer.range.is_none() || layer.range == found.range,
            None => layer.range.is_none(),
        }
    }

    fn of(&self, layer: (usize, usize)) -> Option<Found> {
        self.found.iter().find(|found| found.layer == layer).copied()
    }

    /// Returns true if a layer, which is shown so, is to have its first range: it has none, or the one that
    /// was found of fewer rows.
    fn is_due(&self, layer: (usize, usize), options: &LayerOptions) -> bool {
        match self.of(layer) {
            Some(Found { is_last: true, range, .. }) => options.range.is_none() && range.is_some(),
            Some(found) => options.range.is_none() || options.range == found.range,
            None => options.range.is_none(),
        }
    }

    /// Gives layers that are due the range that `look` finds, or that it found before. `shown` are the
    /// numbers of the layers in their textures; `is_last` says of which textures all rows are there. Returns
    /// what there is to say of the last range that was looked for.
    fn give(
        &mut self,
        layers: &mut [LayerOptions],
        shown: &[usize],
        is_last: impl Fn(usize) -> bool,
        mut look: impl FnMut(usize) -> Option<([f32; 2], String)>,
    ) -> Option<String> {
        let mut said = None;
        let mut found = self.found.clone();
        for (n, (options, &layer)) in layers.iter_mut().zip(shown).enumerate() {
            let key = (options.texture, layer);
            if !self.is_due(key, options) {
                continue;
            }
            let known = self.of(key).filter(|found| found.is_last);
            let new = known.unwrap_or_else(|| {
                let (range, text) = look(n).unzip();
                said = text.or(said.take());
                Found { layer: key, range, is_last: is_last(options.texture) }
            });
            options.range = new.range;
            found.retain(|found| found.layer != key);
            found.push(new);
        }
        self.found = found;
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A layer is given its range where `found` is what its values say.
    fn give(
        ranges: &mut FirstRanges,
        layers: &mut [LayerOptions],
        shown: &[usize],
        is_last: bool,
        found: Option<[f32; 2]>,
    ) -> Option<String> {
        let text = |range: [f32; 2]| (range, format!("{range:?}"));
        ranges.give(layers, shown, |_| is_last, |_| found.map(text))
    }

    #[test]
    fn a_range_of_a_share_of_rows_is_taken_back_and_what_a_person_chose_is_not() {
        let (dark, all) = (Some([0.0, 0.1]), Some([0.0, 0.9]));
        let (mut ranges, mut layers) = (FirstRanges::default(), [LayerOptions::default()]);
        give(&mut ranges, &mut layers, &[0], false, dark);
        assert_eq!(layers[0].range, dark);
        give(&mut ranges, &mut layers, &[0], true, None);
        assert_eq!(layers[0].range, None, "0 and 1 are black and white of the whole image");
        assert!(!ranges.is_due((0, 0), &layers[0]), "that is the last word");
        // Another share, another range; the other way round too.
        let (mut ranges, mut layers) = (FirstRanges::default(), [LayerOptions::default()]);
        for (found, is_last) in [(None, false), (dark, false), (None, false), (all, true)] {
            let said = give(&mut ranges, &mut layers, &[0], is_last, found);
            assert_eq!((layers[0].range, said.is_some()), (found, found.is_some()));
        }
        let (mut ranges, mut layers) = (FirstRanges::default(), [LayerOptions::default()]);
        give(&mut ranges, &mut layers, &[0], false, dark);
        layers[0].range = Some([0.2, 0.3]);
        give(&mut ranges, &mut layers, &[0], true, all);
        assert_eq!(layers[0].range, Some([0.2, 0.3]));
    }

    #[test]
    fn a_layer_that_is_reset_or_chosen_later_has_its_first_range() {
        let (metres, depths) = (Some([300.0, 900.0]), Some([-80.0, 0.0]));
        let (mut ranges, mut layers) = (FirstRanges::default(), [LayerOptions::default()]);
        give(&mut ranges, &mut layers, &[0], true, metres);
        layers[0].range = Some([1.0, 2.0]);
        assert!(!ranges.is_due((0, 0), &layers[0]));
        layers[0] = LayerOptions::default();
        let said = give(&mut ranges, &mut layers, &[0], true, depths);
        assert_eq!((layers[0].range, said), (metres, None), "as at first");
        // Another layer of the texture takes its place, and one is laid over it.
        let mut layers = [LayerOptions::default(), LayerOptions { texture: 1, ..LayerOptions::default() }];
        give(&mut ranges, &mut layers, &[2, 0], true, depths);
        assert_eq!(layers.map(|layer| layer.range), [depths; 2]);
        // The same layer twice.
        let (mut ranges, mut layers) = (FirstRanges::default(), [0; 2].map(|_| LayerOptions::default()));
        give(&mut ranges, &mut layers, &[0, 0], false, metres);
        give(&mut ranges, &mut layers, &[0, 0], true, depths);
        assert_eq!(layers.map(|layer| layer.range), [depths; 2]);
    }
}
