//! What a window shows, as a text.

use vastex::Filter;

use super::SurfaceScene;
use crate::camera::Pose;
use crate::surface::LayerOptions;
use crate::view_text::ViewText;

impl SurfaceScene {
    /// What a camera at a pose shows, as a text; `None` if nothing is displayed.
    pub fn view_text(&self, pose: Pose) -> Option<String> {
        let displayed = self.display.displayed()?;
        let mut options = self.settings.options.clone();
        // How texels are blended is said of each layer.
        let filter = self.textures.inspect().settings().filter;
        let planet = &mut options.planet;
        let layers = options.layers.iter_mut().chain(&mut planet.night).chain(&mut planet.clouds);
        for layer in layers.filter(|layer| layer.filter.is_none() && filter != Filter::default()) {
            layer.filter = Some(filter);
        }
        let (scene, overlay) = (self.settings.scene, self.settings.overlay);
        let count = displayed.textures().len();
        let mut view = ViewText::of(pose, scene, &options, overlay, count);
        // Where values would say what is black and white, a person's choice of the whole scale is said.
        for (said, shown) in view.layers.iter_mut().zip(&options.layers) {
            if self.settings.range_is_free && self.first_ranges.has_range(shown.texture) {
                said.range = shown.range;
            }
        }
        // Values that have yet to say what is black and white say it where the view is shown, too: a layer
        // that is named has all of the scale there. What a person chose of layers is kept all the same.
        let layers = if options.layers.is_empty() { &view.layers } else { &options.layers };
        let is_due = |layer: &LayerOptions| self.first_ranges.is_due_in(self.layers_of, layer);
        if self.settings.range_is_free && are_usual(layers, count) && layers.iter().any(is_due) {
            view.layers.clear();
        }
        Some(view.to_text(displayed.size))
    }
}

/// Returns true if so many textures are shown as they are at first, their ranges apart.
fn are_usual(layers: &[LayerOptions], textures: usize) -> bool {
    let is_usual = |(texture, layer): (usize, &LayerOptions)| {
        LayerOptions { range: None, ..layer.clone() } == LayerOptions::first_of(texture)
    };
    layers.len() == textures && layers.iter().enumerate().all(is_usual)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_usual_until_more_than_their_range_is_chosen() {
        let first = LayerOptions::first_of;
        let ranged = LayerOptions { range: Some([0.1, 0.2]), ..first(1) };
        assert!(are_usual(&[first(0), ranged.clone()], 2));
        assert!(!are_usual(&[ranged.clone(), first(0)], 2), "in another order");
        assert!(!are_usual(&[first(0)], 2), "one is hidden");
        for chosen in [
            LayerOptions { gamma: 2.0, ..ranged.clone() },
            LayerOptions { is_visible: false, ..ranged.clone() },
            LayerOptions { opacity: 0.5, ..ranged },
        ] {
            assert!(!are_usual(&[first(0), chosen], 2));
        }
    }
}
