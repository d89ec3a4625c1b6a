//! How a frame of a scene in a window comes about.

use vastex::ViewId;
use vastex::diagnostics::ExplainedPixel;

use super::SurfaceScene;
use super::displayed::Displayed;
use super::source::DisplayError;
use crate::camera::Pose;
use crate::gpu::Gpu;
use crate::inspect;
use crate::panels::PanelPainter;
use crate::stage::{Frame, Pictures, StageView, Target, draw_again};

/// Hears in front of the commands of each part of a frame which part that is, and nothing at the end; may add
/// commands of its own that measure them.
pub type MarkParts<'a> = &'a mut dyn FnMut(&mut wgpu::CommandEncoder, Option<&'static str>);

impl SurfaceScene {
    /// A frame begins, of a camera at a pose: what is sharp enough takes its place, and what the machine does
    /// is drawn small for its panel, where that is shown. What the pictures of the window have to be is
    /// [`SurfaceScene::format`] from here on.
    pub fn begin_frame(&mut self, pose: Pose, painter: &mut PanelPainter) -> Result<(), vastex::Error> {
        self.beside.take_stale();
        if let Some(preview) = self.display.take_over(self.textures.stats().converged, self.beside.now()) {
            self.remove([preview]);
        }
        self.ask_below_pointer(pose)?;
        self.draw_small_overlays(pose, painter);
        Ok(())
    }

    /// Records what a camera at a pose sees into a target of the window's size, over nothing; the host draws
    /// the panels over that and submits it. `None` if nothing is displayed. Where the target keeps pictures,
    /// and this one would be the last one again, nothing of it is drawn, and the part of the frame is `kept`.
    pub fn record(
        &mut self,
        pose: Pose,
        target: &Target<'_>,
        mark: MarkParts<'_>,
    ) -> Result<Option<wgpu::CommandEncoder>, DisplayError> {
        let (size, pane) = (self.size, self.size());
        self.display.count_frame();
        let ground = self.beside.ground();
        if let Some(source) = self.display.displayed_mut() {
            source.follow(
                &self.gpu,
                &mut self.textures,
                &self.settings,
                pose.magnification(pane, source.size),
            )?;
            source.renderer.set_ground(ground);
            source.show_rows(&self.gpu, &self.textures);
        }
        let is_alone = self.display.next().is_none();
        let Gpu { device, queue, .. } = &self.gpu;
        if let Some(Displayed { renderer, overlay: Some(overlay), .. }) = self.display.displayed_mut() {
            renderer.set_pose(queue, &self.textures, &pose, size);
            overlay.look(device, queue, &self.textures, renderer, size)?;
        }
        let next = self.display.next().map(|next| &next.renderer);
        let Some(displayed) = self.display.displayed() else { return Ok(None) };
        if let Some(since) = self.beside.count_frame() {
            self.textures.set_frame_time(since);
        }
        // What comes next says what it wants, and what is displayed is drawn as it is.
        let heard = next.unwrap_or(&displayed.renderer);
        let views = [StageView { view: ViewId::MAIN, camera: heard.camera(), pose }];
        // An overlay hides the picture.
        let is_behind = displayed.overlay.is_some() || !is_alone;
        let pictures = if is_behind { Pictures::ForFeedback } else { Pictures::Always };
        let recorded = Frame { views: &views, expected: None, picture: size, has_feedback: true, pictures };
        let renderer = &displayed.renderer;
        // While a camera moves each picture is another one.
        let may_keep = !is_behind && self.keeps_pictures() && self.last_picture.stands(&pose);
        if !is_alone {
            renderer.set_pose(queue, &self.textures, &pose, size);
        }
        let (gpu, textures) = (&self.gpu, &mut self.textures);
        let mut encoder = recorded.record_wanted(gpu, textures, heard, |_, _| Ok(()), &mut *mark)?;
        // While tiles fade in each picture is another one, too.
        let kept = if may_keep && self.content().is_some() { self.kept_in(target) } else { None };
        let target = &if kept.is_some() { *target } else { target.passing() };
        if kept.as_ref().is_some_and(|kept| self.is_kept(pose, kept)) {
            mark(&mut encoder, Some("kept"));
            target.encode(&mut encoder);
        } else {
            mark(&mut encoder, Some("picture"));
            recorded.record_pictures(&mut encoder, &mut self.textures, heard, target)?;
        }
        mark(&mut encoder, None);
        match &displayed.overlay {
            Some(overlay) => {
                mark(&mut encoder, Some("overlay"));
                overlay.draw(&mut encoder, renderer, &self.textures, target);
                target.encode(&mut encoder);
            }
            None if !is_alone => {
                draw_again(&mut encoder, &self.textures, renderer, renderer.camera(), target);
            }
            None => {}
        }
        self.note_picture(pose, kept);
        Ok(Some(encoder))
    }

    /// The picture that was recorded is on its way: what takes long and the next ones need is done while it
    /// is looked at.
    pub fn end_frame(&mut self) {
        if let Some(displayed) = self.display.displayed() {
            displayed.renderer.compile_all();
        }
        self.last_picture.confirm();
        self.count_unsettled();
        let now = self.beside.now();
        self.below.drawn(now);
    }

    /// The answers that have arrived why pixels show what they show, of those that [`SurfaceScene::explain`]
    /// was asked for; to be called once in each frame. The panel shows them, and those of its own.
    pub fn take_explained(&mut self) -> Result<Vec<ExplainedPixel>, vastex::Error> {
        let mut told = Vec::new();
        for explained in inspect::answers(&mut self.textures)? {
            if let Some(at) = self.to_tell.iter().position(|asked| *asked == explained.pixel) {
                self.to_tell.swap_remove(at);
                told.push(explained.clone());
            }
            self.beside.hud.show_explained(explained);
        }
        Ok(told)
    }
}
