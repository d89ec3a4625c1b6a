//! What the machine does, in a window: what the panel is told of it, and what becomes of what a person
//! changes there.

use vastex::FeedbackMode;

use super::SurfaceScene;
use super::displayed::Displayed;
use crate::beside::{Sampling, SmallOverlays, Tuned};
use crate::camera::Pose;
use crate::hud::{HudChange, HudData, MachineThumbnail, pool_kinds};
use crate::inspect;
use crate::overlay::{Overlay, SmallOverlay};
use crate::panels::PanelPainter;
use crate::surface::LayerOptions;

impl SurfaceScene {
    /// Asks about the pixel below the pointer, while the panel is shown and no other question is open.
    pub(super) fn ask_below_pointer(&mut self, pose: Pose) -> Result<(), vastex::Error> {
        // What was said of a view that has settled since is said anew.
        let has_settled = self.is_settled(&self.textures.stats());
        let had_settled = std::mem::replace(&mut self.beside.hud.had_settled, has_settled);
        self.beside.hud.is_to_ask |= has_settled && !had_settled && self.beside.hud.is_shown();
        if self.textures.pixels().asked() > 0 || !std::mem::take(&mut self.beside.hud.is_to_ask) {
            return Ok(());
        }
        let Some(pixel) = self.beside.hud.pixel else { return Ok(()) };
        let size = self.size;
        if let Some(Displayed { renderer, .. }) = self.display.displayed()
            && pixel[0] < size[0]
            && pixel[1] < size[1]
        {
            let asked = (renderer, renderer.camera(), &pose);
            inspect::ask(&self.gpu, &mut self.textures, asked, size, pixel)?;
        }
        Ok(())
    }

    /// Draws the page table and the pool, small, while the panel is shown.
    pub(super) fn draw_small_overlays(&mut self, pose: Pose, painter: &mut PanelPainter) {
        if !self.beside.hud.is_shown() {
            return;
        }
        let Some(displayed) = self.display.displayed() else {
            self.beside.hud.small = None;
            return;
        };
        let renderer = &displayed.renderer;
        let (format, of) = (displayed.format.viewed, (renderer.layer(), renderer.format()));
        let is_good =
            |small: &SmallOverlays| small.of == of && Some(small.painter) == painter.number_of(format);
        if !self.beside.hud.small.as_ref().is_some_and(is_good) {
            let make = |overlay| SmallOverlay::new(&self.gpu, &self.textures, renderer, overlay, format);
            let overlays = [Overlay::Table, Overlay::Atlas].into_iter().map(make);
            let Ok(overlays) = overlays.collect::<Result<Vec<SmallOverlay>, _>>() else {
                self.beside.hud.small = None;
                return;
            };
            let views: Vec<&wgpu::TextureView> = overlays.iter().map(SmallOverlay::view).collect();
            let (names, painter) = painter.show_pictures(&self.gpu, format, &views);
            self.beside.hud.small = Some(SmallOverlays { overlays, names, painter, of });
        }
        if let Some(small) = &mut self.beside.hud.small {
            for overlay in &mut small.overlays {
                // What cannot be drawn stays as it was: the frame itself says why.
                drop(overlay.draw(&self.gpu, &self.textures, renderer, &pose));
            }
        }
    }

    /// What the panel is told, while it is shown.
    pub(super) fn hud_data(&mut self) -> Option<HudData> {
        if !self.beside.hud.is_shown() {
            return None;
        }
        self.beside.hud.is_stale = false;
        let mut data = HudData::of(&self.textures);
        // What is chosen is seen to be, also before it is there.
        data.feedback = self.feedback_mode();
        let (kinds, sizes) = (pool_kinds(&self.textures), &self.beside.chosen.pools().sizes);
        for pool in &mut data.pools {
            let kind = kinds.get(&pool.stats.pool);
            pool.is_sized_by_hand = kind.is_some_and(|kind| sizes.contains_key(kind));
        }
        let hud = &self.beside.hud;
        if let Some(SmallOverlays { overlays, names, .. }) = &hud.small {
            let thumbnail = |(overlay, name): (&SmallOverlay, &egui::TextureId)| MachineThumbnail {
                overlay: overlay.overlay(),
                picture: *name,
                size: overlay.size(),
            };
            data.thumbnails = overlays.iter().zip(names).map(thumbnail).collect();
        }
        Some(HudData {
            filter: self.settings.options.layers.first().and_then(|layer| layer.filter),
            overlay: self.settings.overlay,
            explained: hud.explained.clone(),
            frames: hud.frames.clone(),
            gpu_times: hud.gpu_times.clone(),
            ..data
        })
    }

    /// Changes what a person changed in the panel. What cannot be is said, and stays as it was.
    pub(crate) fn change(&mut self, change: &HudChange) {
        let name = self.name().to_owned();
        let tuned = Tuned { name: &name, textures: &mut self.textures, keeps_pools: true };
        match self.beside.tune(tuned, change) {
            Some(Sampling::Filter(filter)) => {
                self.beside.chosen.set_filter(filter);
                self.show_layers(filtered(self.layers_or_first(), filter));
            }
            Some(Sampling::Overlay(overlay)) => self.show_overlay(overlay),
            Some(Sampling::Feedback(mode)) => self.change_feedback(mode),
            None => {}
        }
        self.wake();
    }

    /// The mode of feedback, or the one that is wanted in its place.
    pub fn feedback_mode(&self) -> FeedbackMode {
        self.wanted_feedback.unwrap_or_else(|| self.textures.inspect().feedback_mode())
    }

    /// Wants textures with another mode of feedback. Those that there are are drawn until the host hands
    /// others over ([`SurfaceScene::exchange`]).
    fn change_feedback(&mut self, mode: FeedbackMode) {
        let is_another = mode != self.textures.inspect().feedback_mode();
        self.wanted_feedback = is_another.then_some(mode);
        self.feedback_is_news = true;
        if is_another {
            self.beside.notify(&format!("feedback: {}, as soon as it has a picture", mode.name()));
        } else {
            self.beside.chosen.set_feedback(mode);
        }
    }

    /// Returns true if since the last call textures with another mode of feedback are wanted than before, or
    /// none any more.
    pub fn take_feedback_news(&mut self) -> bool {
        std::mem::take(&mut self.feedback_is_news)
    }

    /// The mode of feedback that textures are wanted with in the place of those that there are, if any are.
    pub fn wanted_feedback(&self) -> Option<FeedbackMode> {
        self.wanted_feedback
    }

    /// Wants no other mode of feedback any more: why there is none is told.
    pub fn refuse_feedback(&mut self, why: &str) {
        self.wanted_feedback = None;
        let message = format!("the feedback mode stays as it was: {why}");
        let said = format!("{}: {message}", self.name());
        self.beside.log(said);
        self.beside.show_error("feedback", &message);
    }
}

fn filtered(mut layers: Vec<LayerOptions>, filter: Option<vastex::Filter>) -> Vec<LayerOptions> {
    layers.iter_mut().for_each(|layer| layer.filter = filter);
    layers
}
