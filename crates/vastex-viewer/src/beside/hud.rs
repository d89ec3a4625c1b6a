//! What the machine does, beside a picture: the panel, and what it is told beside what the textures say.

use glam::DVec2;
use vastex::diagnostics::ExplainedPixel;

use super::Beside;
use crate::hud::{FrameTimes, Hud};
use crate::overlay::SmallOverlay;
use crate::stage::PartTime;

/// What the machine does: the panel, and what it is told beside what the textures say.
#[derive(Default)]
pub(crate) struct SceneHud {
    /// The panel.
    pub(crate) panel: Hud,
    is_shown: bool,
    /// The times from frame to frame, where the next follows without a pause.
    pub(crate) frames: FrameTimes,
    /// What the GPU took for the parts of a frame, which is empty before that is measured; `None` if it does
    /// not tell.
    pub(crate) gpu_times: Option<Vec<PartTime>>,
    pub(crate) small: Option<SmallOverlays>,
    pub(crate) explained: Option<ExplainedPixel>,
    /// The pixel below the pointer, and whether it has yet to be asked about.
    pub(crate) pixel: Option<[u32; 2]>,
    pub(crate) is_to_ask: bool,
    /// True if the view had settled in the last frame.
    pub(crate) had_settled: bool,
    /// True if something has come that the panel does not show yet.
    pub(crate) is_stale: bool,
}

/// The page table and the pool, small, and by what they are known to what draws the panel.
pub(crate) struct SmallOverlays {
    pub(crate) overlays: Vec<SmallOverlay>,
    pub(crate) names: Vec<egui::TextureId>,
    pub(crate) painter: u64,
    /// What they are of.
    pub(crate) of: (vastex::LayerId, wgpu::TextureFormat),
}

impl SceneHud {
    /// One that is hidden, before anything is measured.
    pub(crate) fn new() -> SceneHud {
        SceneHud { gpu_times: Some(Vec::new()), ..SceneHud::default() }
    }

    /// Returns true if the panel is shown.
    pub(crate) fn is_shown(&self) -> bool {
        self.is_shown
    }

    /// Shows the panel, or not, as when the window was closed last; where that is narrow, nobody has asked
    /// for it.
    pub(crate) fn show_as_before(&mut self, is_shown: bool) {
        self.is_shown = is_shown;
    }

    /// The pointer is over this pixel of the picture, or over none.
    pub(crate) fn pointer_moved(&mut self, pixel: Option<DVec2>) {
        let pixel = pixel.filter(|pixel| self.is_shown && pixel.min_element() >= 0.0);
        self.pixel = pixel.map(|pixel| [pixel.x as u32, pixel.y as u32]);
        self.is_to_ask = self.pixel.is_some();
    }

    /// Returns true if a frame is due for the panel alone, of a view that has settled.
    pub(crate) fn is_due(&self) -> bool {
        self.has_news() || self.is_shown && !self.had_settled
    }

    /// Returns true if the panel has something to show or to ask.
    pub(crate) fn has_news(&self) -> bool {
        self.is_shown && (self.is_stale || self.is_to_ask)
    }

    /// Why a pixel shows what it shows, for the frame that comes.
    pub(crate) fn show_explained(&mut self, explained: ExplainedPixel) {
        self.explained = Some(explained);
        self.is_stale = true;
    }

    /// The textures are others: what was made from them and what was asked of them is gone.
    pub(crate) fn forget_textures(&mut self) {
        (self.small, self.explained) = (None, None);
        self.is_to_ask = self.pixel.is_some();
        self.is_stale = true;
    }

    /// The device is gone, and what was made on it.
    pub(crate) fn forget_device(&mut self) {
        (self.gpu_times, self.small) = (Some(Vec::new()), None);
    }
}

impl Beside {
    /// Shows what the machine does, or hides it.
    pub(crate) fn show_or_hide_hud(&mut self) {
        // Where it gave way to the panel, it comes back.
        let (hud, panel) = (&mut self.hud, &mut self.panel);
        hud.is_shown = !hud.is_shown || panel.hides_machine();
        panel.machine_comes();
        (hud.small, hud.explained, hud.pixel) = (None, None, None);
        hud.is_to_ask = false;
    }
}
