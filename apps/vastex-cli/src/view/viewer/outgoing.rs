//! What a picture or a text of the window has to say.

use std::path::{Path, PathBuf};

use vastex::Filter;
use vastex_scenes::Pose;
use vastex_viewer::ViewText;

use super::Viewer;
use crate::screenshot::{Shot, ShotCamera};

impl Viewer {
    /// What a picture shows of a source and of the files over it, so many times as large as the window: from
    /// where the camera is, or all of an image if that `is_fitted`, without a panel beside it. `None` if
    /// nothing is displayed.
    pub(in super::super) fn shot(
        &self,
        (source, over): (&Path, &[PathBuf]),
        (pose, is_fitted): (Pose, bool),
        times: u32,
    ) -> Option<Shot> {
        self.display.displayed()?;
        Some(Shot {
            source: source.to_owned(),
            over: over.to_vec(),
            scene: self.settings.scene,
            camera: if is_fitted { ShotCamera::Fitted } else { ShotCamera::At(pose) },
            options: self.settings.options.clone(),
            overlay: self.settings.overlay,
            range_is_free: false,
            ground: self.ground(),
            may_be_crisp: self.settings.may_be_crisp,
            size: self.surface.size().map(|side| side.saturating_mul(times)),
            pixels_per_point: self.window.scale_factor() as f32 * times as f32,
            has_guides: self.panel.guides_are_shown(),
            measure: self.panel.measure.clone(),
            has_hud: self.hud.is_shown() && !self.panel.hides_machine(),
        })
    }

    /// What is shown, as a text; `None` if nothing is.
    pub(in super::super) fn view_text(&self, pose: Pose) -> Option<String> {
        #[cfg(feature = "volumes")]
        if let Some(text) = self.volume_text() {
            return Some(text);
        }
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
        Some(ViewText::of(pose, scene, &options, overlay, count).to_text(displayed.size))
    }
}
