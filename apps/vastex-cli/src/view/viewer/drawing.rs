//! How a frame of the window comes about.

use anyhow::Result;
use vastex_scenes::Pose;
use vastex_viewer::stage::GpuTimer;

use super::super::surface::SurfaceFrame;
use super::Viewer;

impl Viewer {
    /// Draws and shows a frame, where the window shows any.
    pub(in super::super) fn draw(&mut self, pose: Pose) -> Result<()> {
        self.look_at_window();
        #[cfg(feature = "volumes")]
        if self.shows_volume() {
            return self.draw_volume();
        }
        self.scene.begin_frame(pose, &mut self.shell.painter)?;
        self.scene.format().iter().for_each(|format| self.surface.set_format(format));
        let (shell, kept) = (&mut self.shell, (self.recent.files(), self.bookmarks.views()));
        self.scene.show_panels(pose, kept, |show| shell.run(show));
        let frame = self.surface.acquire();
        if !matches!(frame, Ok(Some(_))) {
            self.scene.textures().inspect().check_device()?; // a lost one is the reason, whatever the window says
        }
        let frame = frame?;
        self.scene.beside.window.is_hidden = frame.is_none();
        let Some(frame) = frame else { return Ok(()) };
        self.draw_into(frame, pose)?;
        self.scene.end_frame();
        self.print_explained()?;
        let stats = self.scene.textures().stats();
        let is_source = self.scene.display().is_source();
        self.frames += u64::from(is_source);
        let (is_settled, is_busy) = (self.scene.is_settled(&stats), self.scene.beside.is_busy());
        if let Some(times) = self.times.as_mut().filter(|_| !self.scene.is_empty()) {
            times.note_frame(is_source, is_settled, is_busy);
        }
        self.report_events(&stats);
        if let Some(title) = self.scene.title(&stats, pose) {
            self.window.set_title(title);
        }
        Ok(())
    }

    /// Returns true if a volume is shown: without what reads them there is none.
    #[cfg(not(feature = "volumes"))]
    pub(in super::super) fn shows_volume(&self) -> bool {
        false
    }

    /// Draws the scene, or nothing if it shows nothing, with the panels over it, and shows that.
    fn draw_into(&mut self, frame: SurfaceFrame, pose: Pose) -> Result<()> {
        let gpu = self.scene.gpu().clone();
        let is_timed = self.scene.beside.hud.is_shown() && !self.scene.is_empty();
        let mut timer = is_timed.then(|| self.timer.get_or_insert_with(|| GpuTimer::new(&gpu)));
        let mut mark = |encoder: &mut wgpu::CommandEncoder, part: Option<&'static str>| {
            timer.iter_mut().for_each(|timer| timer.mark(encoder, part));
        };
        let target = self.surface.target(&frame.view);
        let recorded = self.scene.record(pose, &target, &mut mark)?;
        let mut encoder = recorded.unwrap_or_else(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            self.surface.clear(&mut encoder, &frame, self.scene.beside.ground().beside());
            encoder
        });
        // What is uploaded for the panel cannot say that the device is gone.
        self.scene.textures().inspect().check_device()?;
        mark(&mut encoder, Some("panels"));
        let over = (&frame.view, self.surface.viewed_format());
        self.shell.painter.paint(&gpu, &mut encoder, over, self.surface.size());
        timer.iter_mut().for_each(|timer| timer.resolve(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
        if let Some(timer) = timer {
            timer.end_frame();
            self.scene.beside.hud.gpu_times = timer.is_able().then(|| timer.times().to_vec());
        }
        self.surface.present(frame);
        Ok(())
    }
}
