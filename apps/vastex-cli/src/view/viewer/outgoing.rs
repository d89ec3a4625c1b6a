//! What a picture or a text of the window has to say.

use std::path::{Path, PathBuf};

use vastex_scenes::{LayerOptions, Pose, Scene};
use vastex_viewer::ViewText;

use super::Viewer;
use crate::screenshot::Shot;

impl Viewer {
    /// What a picture shows of a source and of the files over it, so many times as large as the window;
    /// `None` if nothing is displayed.
    pub(in super::super) fn shot(
        &self,
        (source, over): (&Path, &[PathBuf]),
        pose: Pose,
        times: u32,
    ) -> Option<Shot> {
        self.display.displayed()?;
        Some(Shot {
            source: source.to_owned(),
            over: over.to_vec(),
            scene: self.settings.scene,
            pose: Some(pose),
            options: self.settings.options.clone(),
            overlay: self.settings.overlay,
            may_be_crisp: self.settings.may_be_crisp,
            size: self.surface.size().map(|side| side.saturating_mul(times)),
            pixels_per_point: self.window.scale_factor() as f32 * times as f32,
            has_guides: self.panel.guides_are_shown(),
            has_hud: self.hud.is_shown(),
        })
    }

    /// What is shown, as a text; `None` if nothing is.
    pub(in super::super) fn view_text(&self, pose: Pose) -> Option<String> {
        let displayed = self.display.displayed()?;
        let options = &self.settings.options;
        let view = ViewText {
            pose,
            is_terrain: self.settings.scene == Scene::Terrain,
            layers: said(&options.layers, displayed.textures().len()),
            compare_mode: options.compare_mode,
        };
        Some(view.to_text(displayed.size))
    }
}

/// The layers that a text has to name, of so many textures: none where they are as they are where nothing is
/// said.
fn said(layers: &[LayerOptions], textures: usize) -> Vec<LayerOptions> {
    let usual = |layer: &LayerOptions| LayerOptions {
        range: layer.range.filter(|range| *range != [0.0, 1.0]),
        ..layer.clone()
    };
    let layers: Vec<LayerOptions> = layers.iter().map(usual).collect();
    let first_of = |texture| LayerOptions { texture, ..LayerOptions::default() };
    if layers.iter().cloned().eq((0..textures).map(first_of)) { Vec::new() } else { layers }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_that_nobody_changed_are_not_named() {
        let first = LayerOptions { range: Some([0.0, 1.0]), ..LayerOptions::default() };
        assert!(said(std::slice::from_ref(&first), 1).is_empty());
        assert_eq!(said(std::slice::from_ref(&first), 2).len(), 1, "what lies over it is not shown");
        let dim = LayerOptions { opacity: 0.5, ..first.clone() };
        assert_eq!(said(&[dim], 1)[0].to_string(), ":opacity=0.5");
    }
}
