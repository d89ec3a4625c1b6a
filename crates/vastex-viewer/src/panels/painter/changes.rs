//! Textures of egui on their way to what draws: whole, for another painter, and what has changed since the
//! last one drew.
//!
//! A window that is hidden is not drawn, while its panels go on to run: of what changes meanwhile no more is
//! kept than a painter needs.

use std::collections::HashMap;

use egui::epaint::{ColorImage, ImageData, ImageDelta};
use egui::{TextureId, TextureOptions};

/// Textures, and what has changed of them.
#[derive(Default)]
pub(super) struct TextureChanges {
    images: HashMap<TextureId, (ColorImage, TextureOptions)>,
    changed: Vec<(TextureId, ImageDelta)>,
    /// Those that are not needed once the last run is drawn.
    gone: Vec<TextureId>,
}

impl TextureChanges {
    /// Adds what a run changed, and which textures are gone after it.
    pub(super) fn add(
        &mut self,
        set: impl IntoIterator<Item = (TextureId, ImageDelta)>,
        gone: impl IntoIterator<Item = TextureId>,
    ) {
        // What was gone after a run that nobody drew is not in this one.
        for id in &self.gone {
            self.images.remove(id);
            self.changed.retain(|(other, _)| other != id);
        }
        for (id, delta) in set {
            // What was changed before is changed again.
            if delta.is_whole() {
                self.changed.retain(|(other, _)| *other != id);
            }
            self.keep(id, &delta);
            self.changed.push((id, delta));
        }
        self.gone.extend(gone);
    }

    fn keep(&mut self, id: TextureId, delta: &ImageDelta) {
        let ImageData::Color(part) = &delta.image;
        match delta.pos {
            None => {
                self.images.insert(id, (ColorImage::clone(part), delta.options));
            }
            Some([left, top]) => {
                let Some((image, _)) = self.images.get_mut(&id) else { return };
                let width = part.size[0];
                for (row, pixels) in part.pixels.chunks_exact(width.max(1)).enumerate() {
                    let start = (top + row) * image.size[0] + left;
                    if let Some(place) = image.pixels.get_mut(start..start + width) {
                        place.copy_from_slice(pixels);
                    }
                }
            }
        }
    }

    /// A painter begins that has no textures yet: all of them are changed.
    pub(super) fn begin_again(&mut self) {
        let whole = |(id, (image, options)): (&TextureId, &(ColorImage, TextureOptions))| {
            (*id, ImageDelta::full(image.clone(), *options))
        };
        self.changed = self.images.iter().map(whole).collect();
    }

    /// What has changed since that was asked last.
    pub(super) fn take_changed(&mut self) -> Vec<(TextureId, ImageDelta)> {
        std::mem::take(&mut self.changed)
    }

    /// The textures that are gone since that was asked last, after what was to be drawn with them.
    pub(super) fn take_gone(&mut self) -> Vec<TextureId> {
        let gone = std::mem::take(&mut self.gone);
        gone.iter().for_each(|id| drop(self.images.remove(id)));
        gone
    }
}

#[cfg(test)]
mod tests {
    use egui::Color32;

    use super::*;

    const MAP: TextureId = TextureId::Managed(1);
    const FONT: TextureId = TextureId::Managed(0);

    fn image(size: [usize; 2], shade: u8) -> ColorImage {
        ColorImage::filled(size, Color32::from_gray(shade))
    }

    fn whole(shade: u8) -> ImageDelta {
        ImageDelta::full(image([4, 2], shade), TextureOptions::LINEAR)
    }

    fn part(shade: u8) -> ImageDelta {
        ImageDelta::partial([1, 1], image([2, 1], shade), TextureOptions::LINEAR)
    }

    #[test]
    fn of_a_window_that_is_not_drawn_the_last_textures_are_kept_and_no_others() {
        let mut changes = TextureChanges::default();
        changes.add([(FONT, whole(1))], []);
        for shade in 0..200 {
            changes.add([(MAP, whole(shade))], []);
        }
        changes.add([(FONT, part(9))], []);
        let taken = changes.take_changed();
        assert!(taken == [(FONT, whole(1)), (MAP, whole(199)), (FONT, part(9))], "{} changes", taken.len());
        assert!(changes.take_changed().is_empty());
        // Another painter is told of what is there, once.
        changes.begin_again();
        let mut taken = changes.take_changed();
        taken.sort_by_key(|(id, _)| *id != FONT);
        let [(_, font), (_, map)] = &taken[..] else { panic!("{} textures", taken.len()) };
        let ImageData::Color(font) = &font.image;
        assert_eq!([0, 4, 5, 6, 7].map(|at| font.pixels[at].r()), [1, 1, 9, 9, 1]);
        assert!(*map == whole(199));
    }

    #[test]
    fn textures_that_are_gone_are_told_of_once_they_are_drawn() {
        let mut changes = TextureChanges::default();
        changes.add([(MAP, whole(1))], [MAP]);
        assert_eq!(changes.take_changed().len(), 1, "the run before draws with it");
        assert_eq!(changes.take_gone(), [MAP]);
        // Of one that came and went without being drawn nothing is left.
        changes.add([(MAP, whole(2))], [MAP]);
        changes.add([], []);
        assert!(changes.take_changed().is_empty() && changes.take_gone() == [MAP]);
        changes.begin_again();
        assert!(changes.take_changed().is_empty());
    }
}
