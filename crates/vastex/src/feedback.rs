//! Feedback: how a view says what it wants, in a pass of its own or from its main pass, and how that is heard.
//!
//! Which way is taken is a setting of the whole ([`FeedbackWay`]); what an application calls is the same for all of them. The views
//! themselves are `views`' business.

use vastex_core::{Feedback, FeedbackCompactor, ViewId};
use vastex_wgpu::{
    FeedbackScale, FeedbackTarget, FeedbackWay, GpuError, InlinePipelines, InlineTarget, RawFeedback,
    RawTexture, Readback, ReadbackPipelines, poll,
};

use crate::error::Error;
use crate::textures::{BindGroups, Textures};
use crate::views::ViewState;

/// What gathers feedback on a device, whatever the view and its size.
pub(crate) struct FeedbackPipelines {
    readback: ReadbackPipelines,
    /// Where the way is to tell it.
    inline: Option<InlinePipelines>,
}

impl FeedbackPipelines {
    pub(crate) fn new(device: &wgpu::Device, way: FeedbackWay) -> FeedbackPipelines {
        FeedbackPipelines {
            readback: ReadbackPipelines::new(device, way),
            inline: (way == FeedbackWay::Inline).then(|| InlinePipelines::new(device)),
        }
    }
}

/// Where feedback of a view is gathered, and its way back.
pub(crate) struct FeedbackPath {
    target: Target,
    readback: Readback,
}

enum Target {
    /// By a pass of its own.
    Drawn(FeedbackTarget),
    /// From the main pass.
    Told(InlineTarget),
}

impl FeedbackPath {
    pub(crate) fn oldest(&self) -> Option<u64> {
        self.readback.oldest()
    }

    pub(crate) fn bytes_read(&self) -> u64 {
        self.readback.bytes_read()
    }

    fn picture(&self) -> [u32; 2] {
        match &self.target {
            Target::Drawn(target) => target.picture(),
            Target::Told(target) => target.picture(),
        }
    }
}

impl Target {
    fn raw(&self) -> &RawTexture {
        match self {
            Target::Drawn(target) => target.raw(),
            Target::Told(target) => target.raw(),
        }
    }
}

impl Textures {
    /// Draws the main view's feedback pass of this frame, for a picture of so many pixels: `draw` draws the scene with a pipeline
    /// whose vertex shader ends in `vastex_feedback_clip(clip)` and whose fragment shader returns `vastex_feedback(uv)`, into
    /// [`Textures::FEEDBACK_FORMAT`] and [`Textures::FEEDBACK_DEPTH_FORMAT`] (cleared to 1, or where depth is reversed to 0).
    ///
    /// To be called before [`Textures::update`], once per frame; a frame without it keeps what was wanted. Draws nothing where the way is
    /// [`FeedbackWay::Inline`]; [`Textures::main_pass`] does it then.
    pub fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.feedback_of(encoder, ViewId::MAIN, picture, draw)
    }

    /// Draws the feedback pass of any view, else as [`Textures::feedback`]: at most once per view and frame, with the bind groups
    /// that `draw` is given, which are this view's. A view need not be drawn in every frame: what it wanted in its last 16 feedbacks
    /// stays wanted. Draws nothing for a view that there is not.
    pub fn feedback_of(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        // What is only expected has no main pass.
        if self.way == FeedbackWay::Inline && view != ViewId::EXPECTED {
            return Ok(());
        }
        self.fit_feedback_path(view, picture)?;
        let clear_depth = self.clear_depth();
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        let ViewState { params, groups, path: Some(path), cycle, .. } = state else { return Ok(()) };
        let Target::Drawn(target) = &path.target else { return Ok(()) };
        draw(&mut target.begin(&self.device, encoder, params, cycle.pass(), clear_depth), groups);
        self.record_feedback(encoder, view, self.frame);
        Ok(())
    }

    /// Draws the main view's picture of so many pixels: `draw` records the passes that the application draws it with. Where the way is
    /// [`FeedbackWay::Inline`], the picture says by itself what it wants: its fragment shaders call `vastex_tell(position, wanted)`, and it
    /// begins at the first pixel of its target. Otherwise nothing but `draw` happens, so that an application that calls both this
    /// and [`Textures::feedback`] serves every way.
    ///
    /// To be called after [`Textures::update`], once per frame.
    pub fn main_pass(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        self.main_pass_of(encoder, ViewId::MAIN, picture, draw)
    }

    /// Draws any view's picture, else as [`Textures::main_pass`]: at most once per view and frame, with the bind groups that `draw` is
    /// given, which are this view's. Draws nothing for a view that there is not.
    pub fn main_pass_of(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        let is_told = self.way == FeedbackWay::Inline;
        if is_told {
            self.fit_feedback_path(view, picture)?;
        }
        let reversed_depth = self.settings.reversed_depth;
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        let ViewState { params, groups, path, cycle, .. } = state;
        match path {
            Some(FeedbackPath { target: Target::Told(target), .. }) if is_told => {
                target.begin(&self.device, encoder, params, cycle.pass(), reversed_depth);
                draw(encoder, groups);
                target.end(encoder);
                // The update of its frame is over already.
                self.record_feedback(encoder, view, self.frame.saturating_sub(1));
            }
            _ => draw(encoder, groups),
        }
        Ok(())
    }

    /// Sends what a view's target holds on its way.
    fn record_feedback(&mut self, encoder: &mut wgpu::CommandEncoder, view: ViewId, frame: u64) {
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return };
        let Some(path) = &mut state.path else { return };
        let recorded = path.readback.record(&self.device, encoder, frame);
        // What was dropped meanwhile may have had the same frame: that comes first.
        path.readback.take_lost().into_iter().for_each(|lost| state.cycle.lose(lost));
        if recorded {
            state.cycle.record(frame);
            if let Some(lock_step) = &mut self.lock_step {
                lock_step.feedback_recorded(frame, view);
            }
        }
    }

    pub(crate) fn clear_depth(&self) -> f32 {
        if self.settings.reversed_depth { 0.0 } else { 1.0 }
    }

    /// What every pixel of a picture wants, of each texture by itself, without acting on it: for statistics. Draws as
    /// [`Textures::feedback`] does, whichever the way, at full resolution, and waits for the answer.
    pub fn feedback_of_every_pixel(
        &mut self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Feedback, Error> {
        let target = self.draw_feedback_to_look_at(picture, FeedbackScale::Full, draw)?;
        let raw = RawFeedback::read(&self.device, &self.queue, target.raw())?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(self.frame, &raw.pixels, &mut feedback);
        Ok(self.pager.of_members(&feedback))
    }

    /// The feedback that has arrived, or in lock-step that of the frame before the last, in the order of frames; then what the
    /// application has said of this one.
    pub(crate) fn arrived_feedback(&mut self) -> Result<Vec<Feedback>, Error> {
        let mut arrived = match self.lock_step {
            None => self.polled_feedback()?,
            Some(_) => self.awaited_feedback()?,
        };
        let length = u64::from(self.pager.feedback_cycle());
        for state in &mut self.views {
            let of_view = arrived.iter().filter(|feedback| feedback.view == state.view);
            of_view.for_each(|feedback| state.cycle.come(feedback.frame, length));
            let lost = state.path.iter_mut().flat_map(|path| path.readback.take_lost());
            lost.for_each(|frame| state.cycle.lose(frame));
        }
        arrived.append(&mut self.said);
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

    /// What is due. Feedback whose commands were dropped is left out; that of commands which are not submitted yet comes in the first frame
    /// in which they are.
    fn awaited_feedback(&mut self) -> Result<Vec<Feedback>, Error> {
        let Textures { views, lock_step: Some(lock_step), device, queue, frame, .. } = self else {
            return Ok(Vec::new());
        };
        let (mut arrived, mut late) = (Vec::new(), Vec::new());
        while let Some((of, view)) = lock_step.due_feedback(*frame) {
            let state = views.iter_mut().find(|state| state.view == view);
            let Some(path) = state.and_then(|state| state.path.as_mut()) else { continue };
            match path.readback.wait(device, queue, of) {
                Ok(feedback) => arrived.push(Feedback { view, ..feedback }),
                Err(GpuError::NoFeedback { .. }) if path.readback.is_under_way(of) => late.push((of, view)),
                Err(GpuError::NoFeedback { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        lock_step.feedback_is_late(late);
        Ok(arrived)
    }

    /// Sees what has come back from the GPU, once per frame.
    pub(crate) fn poll_device(&mut self) -> Result<(), Error> {
        if !std::mem::replace(&mut self.is_polled, true) {
            poll(&self.device)?;
        }
        Ok(())
    }

    /// Whether every view that is drawn has been looked at at every sample position, and all that follows is on the GPU.
    pub(crate) fn is_seen_whole(&self) -> bool {
        let length = u64::from(self.pager.feedback_cycle());
        let mut views = self.views.iter().filter(|state| state.view != ViewId::EXPECTED);
        self.undone.is_empty()
            && self.moving.is_settled()
            && views.all(|state| state.cycle.is_seen_whole(self.frame, length))
    }

    /// The oldest frame of which some view's feedback has yet to come.
    pub(crate) fn oldest_feedback(&self) -> Option<u64> {
        self.views.iter().filter_map(ViewState::oldest).min()
    }

    /// Makes a view's path where there is none for pictures of this size.
    fn fit_feedback_path(&mut self, view: ViewId, picture: [u32; 2]) -> Result<(), Error> {
        let state = self.views.iter().find(|state| state.view == view);
        let fits = |path: &FeedbackPath| path.picture() == picture;
        if state.is_none_or(|state| state.path.as_ref().is_some_and(fits)) {
            return Ok(());
        }
        self.catch_up()?;
        let drawn = |scale| Ok(Target::Drawn(FeedbackTarget::new(&self.device, picture, scale)?));
        let target = match self.way {
            _ if view == ViewId::EXPECTED => drawn(FeedbackScale::Coarse),
            _ => match &self.pipelines.inline {
                Some(inline) => Ok(Target::Told(InlineTarget::new(&self.device, inline, picture)?)),
                None => drawn(FeedbackScale::Reduced),
            },
        };
        let target = target.map_err(Error::Gpu)?;
        let readback = Readback::new(&self.device, &self.pipelines.readback, target.raw())?;
        self.forget_feedback_path(view);
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        let is_told = if let Target::Told(target) = &target {
            target.attach(&mut state.params);
            true
        } else {
            false
        };
        state.path = Some(FeedbackPath { target, readback });
        if is_told {
            self.make_all_bind_groups();
        }
        Ok(())
    }

    /// Gives up the feedback of a view that is under way.
    pub(crate) fn forget_feedback_path(&mut self, view: ViewId) {
        if let Some(lock_step) = &mut self.lock_step {
            lock_step.forget_feedback(view);
        }
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            self.counters.feedback_bytes_read += state.bytes_read();
            state.path = None;
            state.cycle.begin_anew();
        }
    }
}
