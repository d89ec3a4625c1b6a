//! What a picture or a text of the window has to say.

use std::path::{Path, PathBuf};

use vastex_scenes::Pose;

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
        self.scene.display().displayed()?;
        let (settings, beside) = (self.scene.settings(), &self.scene.beside);
        Some(Shot {
            source: source.to_owned(),
            over: over.to_vec(),
            scene: settings.scene,
            camera: if is_fitted { ShotCamera::Fitted } else { ShotCamera::At(pose) },
            options: settings.options.clone(),
            overlay: settings.overlay,
            range_is_free: false,
            ground: beside.ground(),
            may_be_crisp: settings.may_be_crisp,
            size: self.surface.size().map(|side| side.saturating_mul(times)),
            pixels_per_point: self.window.scale_factor() as f32 * times as f32,
            has_guides: beside.panel().guides_are_shown(),
            measure: beside.panel().measure.clone(),
            has_hud: beside.hud_is_shown() && !beside.panel().hides_machine(),
        })
    }

    /// What is shown, as a text; `None` if nothing is.
    pub(in super::super) fn view_text(&self, pose: Pose) -> Option<String> {
        match &self.volume {
            Some(volume) => Some(volume.shown.view_text().to_string()),
            None => self.scene.view_text(pose),
        }
    }
}
