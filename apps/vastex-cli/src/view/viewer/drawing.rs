//! How a frame of the window comes about.

use std::time::Instant;

use anyhow::Result;
use vastex::diagnostics::FrameStats;
use vastex_scenes::Pose;
use vastex_viewer::stage::GpuTimer;

use super::super::surface::SurfaceFrame;
use super::{Viewer, shown_of};
use crate::args::Fault;

impl Viewer {
    /// Draws and shows a frame, where the window shows any.
    pub(in super::super) fn draw(&mut self, pose: Pose) -> Result<()> {
        self.look_at_window();
        #[cfg(feature = "volumes")]
        self.bring_to_volume();
        let panels_are_due = self.shell.due_in(Instant::now()).is_some_and(|due| due.is_zero());
        let mut shown = shown_of(&mut self.scene, &mut self.volume);
        let is_due = shown.begin_frame((pose, panels_are_due), &mut self.shell.painter)?;
        if is_due {
            let name = shown.name().to_owned();
            shown.format().iter().for_each(|format| self.surface.set_format(format));
            let (shell, kept) = (&mut self.shell, (self.recent.files(), self.bookmarks.views()));
            shown.show_panels(pose, kept, |show| shell.run(&name, show));
        }
        #[cfg(feature = "volumes")]
        self.read_for_volume();
        if !is_due {
            return Ok(());
        }
        // A lost one is the reason, whatever the window says, and gives no picture without a panic.
        self.check_device()?;
        let shown = shown_of(&mut self.scene, &mut self.volume);
        let textures = shown.textures();
        let frame = self.surface.acquire(|| textures.inspect().check_device().is_err());
        if !matches!(frame, Ok(Some(_))) {
            self.check_device()?;
        }
        let frame = frame?;
        self.scene.beside.set_hidden(frame.is_none());
        let Some(frame) = frame else { return Ok(()) };
        self.draw_into(frame, pose)?;
        self.shown().end_frame();
        if !self.shows_volume() {
            self.print_explained()?;
        }
        let shown = self.shown();
        let (stats, is_source) = (shown.textures().stats(), shown.is_source());
        let is_settled = shown.is_settled(&stats);
        self.frames += u64::from(is_source);
        if is_source && let Some(fault) = self.fault.take() {
            self.suffer(fault);
        }
        let is_busy = self.scene.beside.is_busy();
        if let Some(times) = self.times.as_mut().filter(|_| !self.scene.is_empty()) {
            times.note_frame(is_source, is_settled, is_busy);
        }
        self.tell_of_frame(&stats, pose);
        Ok(())
    }

    /// Draws a frame that nobody sees.
    pub(in super::super) fn draw_unseen(&mut self, pose: Pose) -> Result<()> {
        self.check_device()?;
        let mut shown = self.shown();
        shown.draw_unseen(pose)?;
        let stats = shown.textures().stats();
        self.tell_of_frame(&stats, pose);
        Ok(())
    }

    /// Says what there is to say after a frame.
    fn tell_of_frame(&mut self, stats: &FrameStats, pose: Pose) {
        if !self.shows_volume() {
            self.report_events(stats);
        }
        let window = self.window.clone();
        if let Some(title) = self.shown().title(stats, pose) {
            window.set_title(title);
        }
    }

    /// Fails where the device is lost.
    fn check_device(&mut self) -> Result<()> {
        Ok(self.shown().textures().inspect().check_device()?)
    }

    /// Has something go wrong once, for tests.
    fn suffer(&mut self, fault: Fault) {
        match fault {
            Fault::Device => self.scene.gpu().device.destroy(),
            fault => self.surface.suffer(fault),
        }
    }

    /// Draws the scene, or nothing if it shows nothing, with the panels over it, and shows that.
    fn draw_into(&mut self, frame: SurfaceFrame, pose: Pose) -> Result<()> {
        let gpu = self.scene.gpu().clone();
        let shown = self.shown();
        let (is_recorded, ground) = (shown.is_recorded(), shown.ground());
        let is_timed = is_recorded && self.scene.beside.hud_is_shown();
        let mut timer = is_timed.then(|| self.timer.get_or_insert_with(|| GpuTimer::new(&gpu)));
        let mut mark = |encoder: &mut wgpu::CommandEncoder, part: Option<&'static str>| {
            timer.iter_mut().for_each(|timer| timer.mark(encoder, part));
        };
        self.surface.keep_pictures(self.scene.keeps_pictures());
        let target = self.surface.target(&frame.view);
        let mut shown = shown_of(&mut self.scene, &mut self.volume);
        let recorded = shown.record(pose, &target, &mut mark)?;
        let mut encoder = recorded.unwrap_or_else(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            self.surface.clear(&mut encoder, &frame, ground);
            encoder
        });
        // What is uploaded for the panel cannot say that the device is gone.
        shown.textures().inspect().check_device()?;
        mark(&mut encoder, Some("panels"));
        let over = (&frame.view, self.surface.viewed_format());
        self.shell.painter.paint(&gpu, &mut encoder, over, self.surface.size());
        timer.iter_mut().for_each(|timer| timer.resolve(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
        if let Some(timer) = timer {
            timer.end_frame();
            self.scene.beside.set_gpu_times(timer.is_able().then(|| timer.times().to_vec()));
        }
        self.surface.present(frame);
        Ok(())
    }
}
