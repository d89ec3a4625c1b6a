//! How a frame of the window comes about.

use std::time::Instant;

use anyhow::Result;
use vastex::ViewId;
use vastex_scenes::{Gpu, Pose};
use vastex_viewer::layers::Ground;
use vastex_viewer::stage::{Frame, Pictures, StageView, draw_again};

use super::super::displayed::Displayed;
use super::super::surface::SurfaceFrame;
use super::Viewer;

impl Viewer {
    /// Draws and shows a frame, where the window shows any.
    pub(in super::super) fn draw(&mut self, pose: Pose) -> Result<()> {
        #[cfg(feature = "volumes")]
        if self.shows_volume() {
            return self.draw_volume();
        }
        if let Some(preview) = self.display.take_over(self.textures.stats().converged, Instant::now()) {
            self.remove([preview]);
        }
        self.ask_below_pointer(pose)?;
        self.draw_small_overlays(pose);
        // What lies over the picture is where the picture has it, and a person may change how it is compared.
        self.compare();
        self.run_panel(pose);
        self.compare();
        self.look_beside_panels();
        let frame = self.surface.acquire();
        if !matches!(frame, Ok(Some(_))) {
            self.textures.inspect().check_device()?; // a lost one is the reason, whatever the window says
        }
        let frame = frame?;
        self.is_hidden = frame.is_none();
        match frame {
            None => return Ok(()),
            Some(frame) if self.is_empty() => {
                self.textures.inspect().check_device()?;
                self.draw_empty(frame);
            }
            Some(frame) => self.draw_displayed(frame, pose)?,
        }
        self.below.drawn(Instant::now());
        let stats = self.textures.stats();
        let (is_source, is_settled) = (self.display.is_source(), self.is_settled(&stats));
        if let Some(times) = self.times.as_mut().filter(|_| self.display.displayed().is_some()) {
            times.note_frame(is_source, is_settled, self.is_busy);
        }
        self.report_events(&stats);
        self.update_title(&stats, pose);
        Ok(())
    }

    /// Returns true if a volume is shown: without what reads them there is none.
    #[cfg(not(feature = "volumes"))]
    pub(in super::super) fn shows_volume(&self) -> bool {
        false
    }

    /// What the picture lies on.
    pub(super) fn ground(&self) -> Ground {
        self.panel.ground.beside(self.shell.is_dark())
    }

    fn draw_empty(&mut self, frame: SurfaceFrame) {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.surface.clear(&mut encoder, &frame, self.ground().beside());
        let over = (&frame.view, self.surface.viewed_format());
        self.shell.paint(&self.gpu, &mut encoder, over, self.surface.size());
        self.gpu.queue.submit([encoder.finish()]);
        self.surface.present(frame);
    }

    fn draw_displayed(&mut self, frame: SurfaceFrame, pose: Pose) -> Result<()> {
        let (size, pane) = (self.surface.size(), self.size());
        let target = self.surface.target(&frame.view);
        self.display.count_frame();
        let ground = self.ground();
        if let Some(source) = self.display.displayed_mut() {
            source.follow(
                &self.gpu,
                &mut self.textures,
                &self.settings,
                pose.magnification(pane, source.size),
            )?;
            source.renderer.set_ground(ground);
        }
        let is_alone = self.display.next().is_none();
        let Gpu { device, queue, .. } = &self.gpu;
        if let Some(Displayed { renderer, overlay: Some(overlay), .. }) = self.display.displayed_mut() {
            renderer.set_pose(queue, &self.textures, &pose, size);
            overlay.look(device, queue, &self.textures, renderer, size)?;
        }
        let next = self.display.next().map(|next| &next.renderer);
        let Some(displayed) = self.display.displayed() else { return Ok(()) };
        let now = Instant::now();
        if let Some(before) = self.drawn_at.replace(now) {
            self.textures.set_frame_time(now.duration_since(before));
            if self.is_busy {
                self.title.count_frame(now.duration_since(before));
                self.hud.frames.push(now.duration_since(before));
            }
        }
        // What comes next says what it wants, and what is displayed is drawn as it is.
        let heard = next.unwrap_or(&displayed.renderer);
        let views = [StageView { view: ViewId::MAIN, camera: heard.camera(), pose }];
        // An overlay hides the picture.
        let is_behind = displayed.overlay.is_some() || !is_alone;
        let pictures = if is_behind { Pictures::ForFeedback } else { Pictures::Always };
        let recorded = Frame { views: &views, expected: None, picture: size, has_feedback: true, pictures };
        let renderer = &displayed.renderer;
        if !is_alone {
            renderer.set_pose(queue, &self.textures, &pose, size);
        }
        let mut timer = self.hud.timer(&self.gpu);
        let mut mark = |encoder: &mut wgpu::CommandEncoder, part: Option<&'static str>| {
            timer.iter_mut().for_each(|timer| timer.mark(encoder, part));
        };
        let mut encoder = recorded.record_marked(
            &self.gpu,
            &mut self.textures,
            heard,
            &target,
            |_, _| Ok(()),
            &mut mark,
        )?;
        match &displayed.overlay {
            Some(overlay) => {
                mark(&mut encoder, Some("overlay"));
                overlay.draw(&mut encoder, renderer, &self.textures, &target);
                target.encode(&mut encoder);
            }
            None if !is_alone => {
                draw_again(&mut encoder, &self.textures, renderer, renderer.camera(), &target);
            }
            None => {}
        }
        let format = self.surface.viewed_format();
        // What is uploaded for the panel cannot say that the device is gone.
        self.textures.inspect().check_device()?;
        mark(&mut encoder, Some("panels"));
        self.shell.paint(&self.gpu, &mut encoder, (&frame.view, format), size);
        timer.iter_mut().for_each(|timer| timer.resolve(&mut encoder));
        queue.submit([encoder.finish()]);
        if let Some(timer) = timer {
            timer.end_frame();
        }
        self.surface.present(frame);
        // While the first picture is looked at.
        renderer.compile_all();
        self.print_explained()?;
        self.frames += u64::from(self.display.is_source());
        self.unsettled = self.unsettled.saturating_sub(1);
        if self.unsettled == 0 && self.textures.inspect().settings().picture != self.surface.size() {
            self.fit_pools();
        }
        Ok(())
    }
}
