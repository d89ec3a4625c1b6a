//! What the machine does, in the window: what the panel is told of it, and what becomes of what a person
//! changes there.

use glam::DVec2;
use vastex::PoolId;
use vastex::diagnostics::ExplainedPixel;
use vastex_scenes::{Gpu, LayerOptions, Overlay, Pose};
use vastex_viewer::hud::{FrameTimes, Hud, HudChange, HudData, MachineThumbnail};
use vastex_viewer::inspect;
use vastex_viewer::overlay::SmallOverlay;
use vastex_viewer::stage::{GpuTimer, TargetKind};

use super::super::displayed::Displayed;
use super::Viewer;
use super::chosen::first_of;
use super::pools::kinds_of;
use crate::report;

/// The panel, and what it is told beside what the textures say.
#[derive(Default)]
pub(super) struct WindowHud {
    pub(super) panel: Hud,
    is_shown: bool,
    /// From frame to frame, where the next follows without a pause.
    pub(super) frames: FrameTimes,
    timer: Option<GpuTimer>,
    small: Option<SmallOverlays>,
    explained: Option<ExplainedPixel>,
    /// The pixel below the pointer, and whether it has yet to be asked about.
    pixel: Option<[u32; 2]>,
    is_to_ask: bool,
    /// True if the view had settled in the last frame.
    had_settled: bool,
    /// True if something has come that the panel does not show yet.
    is_stale: bool,
}

/// The page table and the pool, small, and by what they are known to what draws the panel.
struct SmallOverlays {
    overlays: Vec<SmallOverlay>,
    names: Vec<egui::TextureId>,
    painter: u64,
    /// What they are of.
    of: (vastex::LayerId, wgpu::TextureFormat),
}

impl WindowHud {
    /// Returns true if it is shown.
    pub(super) fn is_shown(&self) -> bool {
        self.is_shown
    }

    /// It is shown as when the window was closed last; where that is narrow, nobody has asked for it.
    pub(super) fn show_as_before(&mut self, is_shown: bool) {
        self.is_shown = is_shown;
    }

    /// What measures a frame while the panel is shown.
    pub(super) fn timer(&mut self, gpu: &Gpu) -> Option<&mut GpuTimer> {
        self.is_shown.then(|| self.timer.get_or_insert_with(|| GpuTimer::new(gpu)))
    }

    /// The pointer is over this pixel of the picture, or over none.
    pub(super) fn pointer_moved(&mut self, pixel: Option<DVec2>) {
        let pixel = pixel.filter(|pixel| self.is_shown && pixel.min_element() >= 0.0);
        self.pixel = pixel.map(|pixel| [pixel.x as u32, pixel.y as u32]);
        self.is_to_ask = self.pixel.is_some();
    }

    /// Returns true if a frame is due for the panel alone.
    pub(super) fn is_due(&self) -> bool {
        self.is_shown && (self.is_stale || self.is_to_ask || !self.had_settled)
    }

    /// Why a pixel shows what it shows, for the frame that comes.
    pub(super) fn show_explained(&mut self, explained: ExplainedPixel) {
        self.explained = Some(explained);
        self.is_stale = true;
    }

    /// The textures are others: what was made from them and what was asked of them is gone.
    pub(super) fn forget_textures(&mut self) {
        (self.small, self.explained) = (None, None);
        self.is_to_ask = self.pixel.is_some();
        self.is_stale = true;
    }

    /// The device is gone, and what was made on it.
    pub(super) fn forget_device(&mut self) {
        (self.timer, self.small) = (None, None);
    }
}

impl Viewer {
    /// Shows what the machine does, or hides it.
    pub(in super::super) fn show_or_hide_hud(&mut self) {
        // Where it gave way to the panel, it comes back.
        self.hud.is_shown = !self.hud.is_shown || self.panel.hides_machine();
        self.panel.machine_comes();
        (self.hud.small, self.hud.explained, self.hud.pixel) = (None, None, None);
        self.hud.is_to_ask = false;
    }

    /// Asks about the pixel below the pointer, while the panel is shown and no other question is open.
    pub(super) fn ask_below_pointer(&mut self, pose: Pose) -> anyhow::Result<()> {
        // What was said of a view that has settled since is said anew.
        let has_settled = self.is_settled(&self.textures.stats());
        let had_settled = std::mem::replace(&mut self.hud.had_settled, has_settled);
        self.hud.is_to_ask |= has_settled && !had_settled && self.hud.is_shown;
        if self.textures.pixels().asked() > 0 || !std::mem::take(&mut self.hud.is_to_ask) {
            return Ok(());
        }
        let Some(pixel) = self.hud.pixel else { return Ok(()) };
        let size = self.surface.size();
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
    pub(super) fn draw_small_overlays(&mut self, pose: Pose) {
        if !self.hud.is_shown {
            return;
        }
        let Some(displayed) = self.display.displayed() else {
            self.hud.small = None;
            return;
        };
        let renderer = &displayed.renderer;
        let (format, of) = (self.surface.viewed_format(), (renderer.layer(), renderer.format()));
        let is_good =
            |small: &SmallOverlays| small.of == of && Some(small.painter) == self.shell.painter_of(format);
        if !self.hud.small.as_ref().is_some_and(is_good) {
            let is_of_surface = [TargetKind::Direct, TargetKind::Linear]
                .map(|kind| kind.drawn_format(format))
                .contains(&of.1);
            let make = |overlay| SmallOverlay::new(&self.gpu, &self.textures, renderer, overlay, format);
            let overlays: Option<Vec<SmallOverlay>> = is_of_surface
                .then(|| {
                    [Overlay::Table, Overlay::Atlas].into_iter().map(make).collect::<Result<_, _>>().ok()
                })
                .flatten();
            let Some(overlays) = overlays else {
                self.hud.small = None;
                return;
            };
            let views: Vec<&wgpu::TextureView> = overlays.iter().map(SmallOverlay::view).collect();
            let (names, painter) = self.shell.show_pictures(&self.gpu, format, &views);
            self.hud.small = Some(SmallOverlays { overlays, names, painter, of });
        }
        if let Some(small) = &mut self.hud.small {
            for overlay in &mut small.overlays {
                // What cannot be drawn stays as it was: the frame itself says why.
                drop(overlay.draw(&self.gpu, &self.textures, renderer, &pose));
            }
        }
    }

    /// What the panel is told, while it is shown.
    pub(super) fn hud_data(&mut self) -> Option<HudData> {
        if !self.hud.is_shown {
            return None;
        }
        self.hud.is_stale = false;
        let mut data = HudData::of(&self.textures);
        // What is chosen is seen to be, also before it is there.
        data.feedback = self.feedback_mode();
        let (kinds, sizes) = (kinds_of(&self.textures), &self.chosen.pools().sizes);
        for pool in &mut data.pools {
            let kind = kinds.get(&pool.stats.pool);
            pool.is_sized_by_hand = kind.is_some_and(|kind| sizes.contains_key(kind));
        }
        let hud = &self.hud;
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
            gpu_times: hud.timer.as_ref().filter(|timer| timer.is_able()).map(|timer| timer.times().to_vec()),
            ..data
        })
    }

    /// Changes what a person changed in the panel. What cannot be is said, and stays as it was.
    pub(super) fn change(&mut self, change: &HudChange) {
        let changed = match *change {
            HudChange::PoolBytes(pool, bytes) => self.size_pool(pool, bytes),
            HudChange::Rule(pool, rule) => {
                if let Some(kind) = self.kind_of_pool(pool) {
                    self.chosen.set_rule(kind, rule);
                }
                self.textures.memory().set_bias_rule(pool, rule)
            }
            HudChange::Budgets { uploads, in_flight } => {
                self.textures.memory().set_budgets(uploads, in_flight);
                self.chosen.set_budgets([uploads, in_flight]);
                Ok(())
            }
            HudChange::Filter(filter) => {
                self.chosen.set_filter(filter);
                self.show_layers(filtered(self.layers_or_first(), filter));
                Ok(())
            }
            HudChange::Overlay(overlay) => {
                self.show_overlay(overlay);
                Ok(())
            }
            HudChange::Feedback(mode) => {
                self.change_feedback(mode);
                Ok(())
            }
        };
        match changed {
            Ok(()) => drop(self.messages.forget("change")),
            Err(error) => {
                report::say(&format!("{}: {error}", self.name()));
                self.tell("change", &error.to_string());
            }
        }
        self.is_shortage_reported = false;
        self.wake();
    }

    fn size_pool(&mut self, pool: PoolId, bytes: Option<u64>) -> Result<(), vastex::Error> {
        match bytes {
            Some(bytes) => self.textures.memory().resize_pool(pool, bytes)?,
            None => self.textures.memory().fit_pool(pool)?,
        };
        if let Some(kind) = self.kind_of_pool(pool) {
            self.chosen.set_size(kind, bytes);
        }
        Ok(())
    }

    /// The layers that are shown, where nobody has chosen any the first of each texture.
    pub(super) fn layers_or_first(&self) -> Vec<LayerOptions> {
        let chosen = self.settings.options.layers.clone();
        let count = self.display.displayed().map_or(0, |displayed| displayed.textures().len());
        if chosen.is_empty() { (0..count).map(first_of).collect() } else { chosen }
    }
}

fn filtered(mut layers: Vec<LayerOptions>, filter: Option<vastex::Filter>) -> Vec<LayerOptions> {
    layers.iter_mut().for_each(|layer| layer.filter = filter);
    layers
}
