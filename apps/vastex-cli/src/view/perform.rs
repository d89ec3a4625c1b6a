//! What becomes of an action that keys, the pointer or the panel ask for.

use anyhow::Result;
use vastex_scenes::{Pose, Scene};
use vastex_viewer::camera::{Controller, Move};
use vastex_viewer::input::Action;
use vastex_viewer::panels::WindowAsked;
use winit::event_loop::ActiveEventLoop;
use winit::window::Fullscreen;

use super::{App, Open};
use crate::report;

/// By how much nearer a double click comes to the ground.
const DOUBLE_CLICK_FACTOR: f64 = 2.0;

impl App {
    /// Says that nothing is shown yet.
    fn notice_of_nothing(&mut self) -> Result<()> {
        self.notify("nothing is shown yet; open a file");
        Ok(())
    }

    /// Carries an action out.
    pub(super) fn perform(&mut self, events: &ActiveEventLoop, action: Action) -> Result<()> {
        if let Action::File(step) = action {
            if self.files.are_none() {
                return self.notice_of_nothing();
            }
            let step = self.files.step(step);
            return self.go_to_file(step);
        }
        if matches!(action, Action::Move(_) | Action::Magnify(..) | Action::Reset | Action::Scene(_)) {
            self.flight.stop();
        }
        let Some(Open { window, viewer, .. }) = &mut self.open else { return Ok(()) };
        let mut shown = viewer.shown();
        if shown.ignores(&action) {
            return Ok(());
        }
        if shown.perform(&action) {
            window.request_redraw();
            return Ok(());
        }
        if viewer.scene.is_empty() && matches!(action, Action::Record | Action::Play | Action::CopyLink) {
            return self.notice_of_nothing();
        }
        let scene_index = self.scene as usize;
        match action {
            Action::Move(moved) => {
                let (camera, aspects) = (&mut self.cameras[scene_index], viewer.scene.aspects());
                viewer.scene.with_heights(|heights| camera.apply_over(moved, aspects, heights));
                if matches!(moved, Move::ToEdge(_) | Move::Screens(_)) {
                    viewer.scene.jumped();
                }
            }
            Action::Magnify(magnification, point) => {
                let (view, image) = (viewer.scene.size(), viewer.scene.image_size());
                self.cameras[scene_index].magnify(magnification, point, view, image);
            }
            Action::Reset => {
                let fitted = viewer.scene.fitted().filter(|_| self.scene == Scene::Image);
                let pose = fitted.unwrap_or(Pose::first(self.scene));
                self.cameras[scene_index] = Controller::new(pose);
                self.fitted = Some(pose);
                viewer.scene.jumped();
            }
            Action::Click(pixel) => viewer.scene.measure_to(pixel, self.cameras[scene_index].pose()),
            Action::DoubleClick if viewer.scene.is_measuring() => viewer.scene.close_measured(),
            Action::DoubleClick => {
                let nearer = viewer.scene.pointed().map(|point| Move::ZoomTo(DOUBLE_CLICK_FACTOR, point));
                let of_ground = nearer.filter(|_| self.scene != Scene::Image).map(Action::Move);
                return self.perform(events, of_ground.unwrap_or(Action::Reset));
            }
            Action::Measure => viewer.scene.measure_or_not(self.cameras[scene_index].pose()),
            Action::Undo => viewer.scene.undo_measured(),
            Action::Scene(choice) => self.choose_scene(choice),
            Action::Overlay => viewer.scene.next_overlay(),
            Action::AutoRange => viewer.scene.set_automatic_range(self.cameras[scene_index].pose()),
            Action::Expose(stops) => viewer.scene.expose(stops),
            Action::EnterPanel => {
                viewer.enter_panel();
                window.request_redraw();
            }
            Action::Compare => viewer.scene.compare_next(),
            Action::Beside => viewer.scene.put_beside(),
            Action::Explain(pixel) => {
                if let Err(error) = viewer.scene.explain(self.cameras[scene_index].pose(), pixel) {
                    self.report_error("explanation", &report::message(&error.into()));
                }
            }
            Action::FillScreen => {
                let filled = window.fullscreen().is_some();
                window.set_fullscreen((!filled).then_some(Fullscreen::Borderless(None)));
            }
            Action::Screenshot(times) => self.shoot(times),
            Action::Record => self.record_or_end(),
            Action::Play => self.play(events)?,
            Action::Open => return self.on_asked(events, WindowAsked::Choose),
            Action::CopyView => self.copy_view(),
            Action::CopyLink => self.copy_link(),
            Action::PasteView => self.ask_to_paste(),
            Action::NewWindow => self.open_window(false),
            Action::Duplicate => self.open_window(true),
            // What stands beside the picture has had its own already.
            Action::Panel | Action::About | Action::Hud | Action::Guides | Action::Values | Action::Keys => {}
            Action::File(_) | Action::Redraw => {}
            // What covers the picture goes first.
            Action::Quit if viewer.scene.beside.hide_keys() || viewer.scene.end_measuring() => {
                window.request_redraw();
            }
            Action::Quit if window.fullscreen().is_some() => window.set_fullscreen(None),
            Action::Quit => events.exit(),
        }
        Ok(())
    }
}
