//! Feedback: how a view says what it wants, in a pass of its own or from its main pass, and how that is
//! heard.
//!
//! Which mode is taken is a setting of the whole ([`FeedbackMode`]); what an application calls is the same
//! for all of them. The views themselves are `views`' business.

use vastex_core::{Feedback, ViewId};
use vastex_wgpu::{
    FeedbackMode, FeedbackPass, FeedbackScale, FeedbackTarget, FeedbackView, GpuError, InlineTarget,
    Readback, poll,
};

use super::feedback_path::{FeedbackPath, Target};
use super::views::{MAIN, ViewState};
use super::{BindGroups, Gpu};
use crate::error::Error;

impl Gpu {
    /// Draws the feedback pass of any view. Leaves it out if there is no such view, and with
    /// [`FeedbackMode::Inline`], but for [`ViewId::EXPECTED`].
    pub(crate) fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        frame: u64,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        if !self.is_drawn_apart(view) {
            return Ok(());
        }
        self.check_number_is_free(view)?;
        self.fit_feedback_path(view, picture)?;
        self.check_once(view, frame)?;
        let clear_depth = self.clear_depth();
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        let look = state.look();
        let ViewState { number, path: Some(path), .. } = state else { return Ok(()) };
        let (Target::Drawn(target), views) = (&path.target, &self.view_params) else { return Ok(()) };
        let mut pass = target.begin(&self.device, encoder, views, *number, look, clear_depth);
        draw(&mut pass, &self.bind_groups);
        drop(pass);
        self.record_feedback(encoder, view, (frame, look));
        Ok(())
    }

    /// Returns true if a view says what it wants in a pass of its own: what is only expected has no main
    /// pass, and a ray has more to say than a pixel of that could.
    pub(super) fn is_drawn_apart(&self, view: ViewId) -> bool {
        let is_of_rays = |state: &ViewState| state.view == view && state.bricks_of_a_ray > 0;
        self.mode != FeedbackMode::Inline || view == ViewId::EXPECTED || self.views.iter().any(is_of_rays)
    }

    /// Draws any view's picture, which says what it wants where that is the mode.
    pub(crate) fn main_pass(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        frame: u64,
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        let is_reported = !self.is_drawn_apart(view);
        if is_reported {
            if self.fit_feedback_path(view, picture)? {
                self.cells_moved = Some(frame);
            }
            self.check_once(view, frame.saturating_sub(1))?;
        }
        let (reversed_depth, has_moved) = (self.reversed_depth, self.cells_moved == Some(frame));
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        let (ViewState { path, cycle, .. }, groups) = (state, &self.bind_groups);
        match path {
            Some(FeedbackPath { target: Target::Reported(target), .. }) if is_reported => {
                let nth = cycle.pass();
                target.begin(&self.device, encoder, &self.view_params, nth, reversed_depth);
                draw(encoder, groups);
                target.end(encoder);
                // The update of its frame is over already.
                let frame = frame.saturating_sub(1);
                self.record_feedback(encoder, view, (frame, FeedbackPass::Cycle(nth)));
                if has_moved {
                    self.look_again(view, frame);
                }
            }
            _ => draw(encoder, groups),
        }
        Ok(())
    }

    /// Fails where a view's feedback of a frame is under way already: two would be taken for one, and half of
    /// what each has seen be missed.
    pub(super) fn check_once(&mut self, view: ViewId, frame: u64) -> Result<(), Error> {
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        // One whose encoder was dropped is as if it had not been drawn.
        let lost = state.path.iter_mut().flat_map(|path| path.readback.take_lost()).collect::<Vec<_>>();
        lost.into_iter().for_each(|lost| state.lose(lost));
        let Some(path) = &state.path else { return Ok(()) };
        if path.readback.is_under_way(frame) { Err(Error::FeedbackTwice { view, frame }) } else { Ok(()) }
    }

    /// Returns true if a picture of this size needs another feedback path, which is made with
    /// [`Gpu::carry_out`] up to date.
    pub(crate) fn needs_feedback_path(&self, view: ViewId, picture: [u32; 2]) -> bool {
        let state = self.views.iter().find(|state| state.view == view);
        let fits = |state: &ViewState| {
            let answers = if state.bricks_of_a_ray > 0 { state.answers() } else { 0 };
            state.path.as_ref().is_some_and(|path| path.fits(picture, answers))
        };
        state.is_some_and(|state| !fits(state))
    }

    /// Sends what a view's target holds on its way.
    pub(super) fn record_feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        (frame, look): (u64, FeedbackPass),
    ) {
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return };
        let Some(path) = &mut state.path else { return };
        self.view_params.end(encoder, state.number);
        let recorded = path.readback.record(&self.device, encoder, frame);
        // What was dropped meanwhile may have had the same frame: that comes first.
        path.readback.take_lost().into_iter().for_each(|lost| state.lose(lost));
        if !recorded {
            state.cycle.find_no_room(frame);
            return;
        }
        state.record(frame, look);
        if let Some(due) = &mut self.due {
            due.record(frame, view);
        }
    }

    pub(super) fn clear_depth(&self) -> f32 {
        if self.reversed_depth { 0.0 } else { 1.0 }
    }

    /// The feedback that has arrived, or in lock-step that of the frame before the last, in the order of
    /// frames. `cycle` is the number of frames in which every pixel is looked at once.
    pub(crate) fn arrived_feedback(&mut self, frame: u64, cycle: u32) -> Result<Vec<Feedback>, Error> {
        let mut arrived = match self.due {
            None => self.polled_feedback()?,
            Some(_) => self.awaited_feedback(frame)?,
        };
        for state in &mut self.views {
            let view = state.view;
            let of_view = arrived.iter_mut().filter(|feedback| feedback.view == view);
            of_view.for_each(|feedback| feedback.gaps = state.come(feedback.frame, cycle));
            let lost = state.path.iter_mut().flat_map(|path| path.readback.take_lost()).collect::<Vec<_>>();
            lost.into_iter().for_each(|frame| state.lose(frame));
        }
        Ok(arrived)
    }

    fn polled_feedback(&mut self) -> Result<Vec<Feedback>, Error> {
        self.poll_device()?;
        self.is_polled = false; // the next frame polls again
        let mut arrived = Vec::new();
        for state in &mut self.views {
            let Some(path) = &mut state.path else { continue };
            while let Some(feedback) = path.readback.poll()? {
                arrived.push(Feedback { view: state.view, ..feedback });
            }
        }
        arrived.sort_by_key(|feedback| feedback.frame);
        Ok(arrived)
    }

    /// What is due. Feedback whose commands were dropped is left out; that of commands which are not
    /// submitted yet comes in the first frame in which they are.
    fn awaited_feedback(&mut self, frame: u64) -> Result<Vec<Feedback>, Error> {
        let Gpu { views, due: Some(due), device, queue, .. } = self else {
            return Ok(Vec::new());
        };
        let (mut arrived, mut late) = (Vec::new(), Vec::new());
        while let Some((of, view)) = due.take(frame) {
            let state = views.iter_mut().find(|state| state.view == view);
            let Some(path) = state.and_then(|state| state.path.as_mut()) else { continue };
            match path.readback.wait(device, queue, of) {
                Ok(feedback) => arrived.push(Feedback { view, ..feedback }),
                Err(GpuError::NoFeedback { .. }) if path.readback.is_under_way(of) => late.push((of, view)),
                Err(GpuError::NoFeedback { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        due.put_back(late);
        Ok(arrived)
    }

    /// Sees what has come back from the GPU, once per frame.
    pub(super) fn poll_device(&mut self) -> Result<(), Error> {
        if !std::mem::replace(&mut self.is_polled, true) {
            poll(&self.device)?;
        }
        Ok(())
    }

    /// Returns true if every view that is drawn has been looked at at every sample position, and all that
    /// follows is on the GPU.
    pub(crate) fn is_seen_whole(&self, frame: u64, cycle: u32) -> bool {
        let mut views = self.views.iter().filter(|state| state.view != ViewId::EXPECTED);
        self.undone.is_empty()
            && self.tables_are_settled()
            && views.all(|state| state.is_seen_whole(frame, cycle))
    }

    /// As [`Gpu::is_seen_whole`], of one view, whatever the others; `None` if there is none.
    pub(crate) fn is_view_seen_whole(&self, view: ViewId, frame: u64, cycle: u32) -> Option<bool> {
        let state = self.views.iter().find(|state| state.view == view)?;
        let is_on_gpu = self.undone.is_empty() && self.tables_are_settled();
        Some(is_on_gpu && state.is_seen_whole(frame, cycle))
    }

    /// The oldest frame of which some view's feedback has yet to come.
    pub(crate) fn oldest_feedback(&self) -> Option<u64> {
        self.views.iter().filter_map(ViewState::oldest).min()
    }

    /// The cells moved while the frame was drawn, before this view or for it: an application that merges
    /// entries into bind groups of its own reported nothing of it where it would be read.
    fn look_again(&mut self, view: ViewId, frame: u64) {
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            state.cycle.lose(frame);
        }
    }

    /// Makes room for what a main view of so many pixels reports, where feedback is inline, so that bind
    /// groups stay when it is drawn.
    pub(crate) fn fit_main_view(&mut self, picture: [u32; 2]) {
        let cells = FeedbackView::new(picture, FeedbackScale::Reduced, 0).target_size();
        // What is too large is refused where it is drawn.
        let fitted = self.view_params.fit_cells(&self.device, MAIN, cells);
        if fitted.is_ok() && self.view_params.is_moved() {
            self.bind_all_anew();
        }
    }

    /// Makes a view's path where there is none for pictures of this size. Returns true if bind groups are
    /// others for it.
    pub(super) fn fit_feedback_path(&mut self, view: ViewId, picture: [u32; 2]) -> Result<bool, Error> {
        if !self.needs_feedback_path(view, picture) {
            return Ok(false);
        }
        let (number, device) = (self.view_number(view), &self.device);
        let answers = self.views.iter().find(|state| state.view == view).map_or(1, ViewState::answers);
        let is_apart = self.is_drawn_apart(view);
        let drawn = |scale| FeedbackTarget::of_rays(device, picture, scale, answers).map(Target::Drawn);
        let target = match self.mode {
            _ if view == ViewId::EXPECTED => drawn(FeedbackScale::Coarse),
            _ => match &self.pipelines.inline {
                Some(inline) if !is_apart => {
                    let views = &mut self.view_params;
                    InlineTarget::new(device, inline, views, number, picture).map(Target::Reported)
                }
                _ => drawn(FeedbackScale::Reduced),
            },
        };
        let target = target.map_err(Error::Gpu)?;
        let readback = Readback::new(&self.device, &self.pipelines.readback, target.raw())?;
        self.forget_feedback_path(view);
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(false) };
        state.path = Some(FeedbackPath { target, readback });
        let is_moved = self.view_params.is_moved();
        if is_moved {
            self.bind_all_anew();
        }
        Ok(is_moved)
    }

    /// Gives up the feedback of a view that is under way.
    pub(super) fn forget_feedback_path(&mut self, view: ViewId) {
        if let Some(due) = &mut self.due {
            due.forget(view);
        }
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            self.sent.feedback_bytes += state.bytes_read();
            (state.path, state.begun) = (None, None);
            state.begin_anew();
        }
    }
}
