//! Views: how each says what it wants, the main view and any beside it.
//!
//! Each has a feedback target, a way back, a uniform and bind groups of its own, so that several can be drawn in one encoder.
//! What follows from what they want, the pagers decide.

use vastex_core::{Feedback, FeedbackCompactor, TextureId, ViewId};
use vastex_wgpu::{FeedbackScale, FeedbackTarget, GpuError, RawFeedback, Readback, ViewBuffer};

use crate::error::Error;
use crate::textures::{BindGroups, Textures};

/// How a view counts among the others.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ViewSettings {
    /// How much a pixel of the view counts, beside 1 for one of the main view, when it is decided what is loaded first: 1/256 to
    /// 256. What a view wants comes however little it counts.
    pub weight: f32,
}

impl Default for ViewSettings {
    fn default() -> ViewSettings {
        ViewSettings { weight: 1.0 }
    }
}

impl ViewSettings {
    /// Sets the weight.
    pub fn with_weight(self, weight: f32) -> ViewSettings {
        ViewSettings { weight, ..self }
    }
}

/// What there is on the GPU for a view.
pub(crate) struct ViewState {
    pub(crate) view: ViewId,
    pub(crate) params: ViewBuffer,
    pub(crate) groups: BindGroups,
    path: Option<FeedbackPath>,
    /// Feedback passes so far. The jitter follows them, so that a view that is not drawn in every frame shows all of its pixels too.
    drawn: u64,
}

/// Where feedback is drawn, and its way back.
struct FeedbackPath {
    target: FeedbackTarget,
    readback: Readback,
}

impl ViewState {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, view: ViewId) -> ViewState {
        let (params, groups) = (ViewBuffer::new(device, queue), BindGroups::default());
        ViewState { view, params, groups, path: None, drawn: 0 }
    }

    /// The oldest frame whose feedback has yet to come.
    fn oldest(&self) -> Option<u64> {
        self.path.as_ref().and_then(|path| path.readback.oldest())
    }

    /// Bytes of feedback brought back, since the target was made.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.path.as_ref().map_or(0, |path| path.readback.bytes_read())
    }
}

impl Textures {
    /// Adds a view beside the main one: a mirror, a shadow, a second eye, a second window. What any view wants is loaded.
    ///
    /// Costs a bind group for each layer of each texture and for each group, and once it is drawn a feedback target.
    pub fn add_view(&mut self, settings: ViewSettings) -> Result<ViewId, Error> {
        let view = self.pagers.add_view(settings.weight)?;
        self.begin_view(view);
        Ok(view)
    }

    /// Makes what a view needs but its feedback target.
    pub(crate) fn begin_view(&mut self, view: ViewId) {
        self.views.push(ViewState::new(&self.device, &self.queue, view));
        let textures: Vec<TextureId> = self.iter().collect();
        textures.into_iter().for_each(|texture| self.make_bind_groups(texture));
        self.bind_groups_anew();
    }

    /// Sets how much a pixel of a view counts, from its next feedback on; see [`ViewSettings::weight`]. Says whether there is
    /// such a view.
    pub fn set_view_weight(&mut self, view: ViewId, weight: f32) -> bool {
        self.pagers.set_weight(view, weight)
    }

    /// Removes a view: what only it wanted is out of view. Says whether there was one; the main view stays.
    pub fn remove_view(&mut self, view: ViewId) -> bool {
        let was_there = self.pagers.remove_view(view);
        if was_there {
            self.forget_feedback_path(view);
            self.views.retain(|state| state.view != view);
        }
        was_there
    }

    /// The main view has jumped: what it wanted before says nothing of what it wants from this frame on.
    pub fn view_cut(&mut self) {
        self.view_cut_of(ViewId::MAIN);
    }

    /// A view has jumped. What the others want stays.
    pub fn view_cut_of(&mut self, view: ViewId) {
        self.pagers.view_cut(view, self.frame);
    }

    /// Draws the main view's feedback pass of this frame, for a picture of so many pixels: `draw` draws the scene with a pipeline
    /// whose vertex shader ends in `vastex_feedback_clip(clip)` and whose fragment shader returns `vastex_feedback(uv)`, into
    /// [`Textures::FEEDBACK_FORMAT`] and [`Textures::FEEDBACK_DEPTH_FORMAT`] (cleared to 1).
    ///
    /// To be called before [`Textures::update`], once per frame; a frame without it keeps what was wanted.
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
        self.fit_feedback_path(view, picture)?;
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(()) };
        let Some(path) = &mut state.path else { return Ok(()) };
        draw(&mut path.target.begin(&self.queue, encoder, &state.params, state.drawn, 1.0), &state.groups);
        state.drawn += 1;
        let recorded = path.readback.record(encoder, self.frame);
        if let Some(lock_step) = self.lock_step.as_mut().filter(|_| recorded) {
            lock_step.feedback_recorded(self.frame, view);
        }
        Ok(())
    }

    /// What every pixel of a picture wants, of each texture by itself, without acting on it: for statistics. Draws as
    /// [`Textures::feedback`] does, at full resolution, and waits for the answer.
    pub fn feedback_of_every_pixel(
        &mut self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Feedback, Error> {
        let target = FeedbackTarget::new(&self.device, picture, FeedbackScale::Full)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let main = &self.views[0];
        draw(&mut target.begin(&self.queue, &mut encoder, &main.params, self.frame, 1.0), &main.groups);
        self.queue.submit([encoder.finish()]);
        let raw = RawFeedback::read(&self.device, &self.queue, &target)?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(self.frame, &raw.pixels, &mut feedback);
        Ok(self.pagers.of_members(&feedback))
    }

    /// The feedback that has arrived, or in lock-step that of the frame before the last, in the order of frames; then what the
    /// application has said of this one.
    pub(crate) fn arrived_feedback(&mut self) -> Result<Vec<Feedback>, Error> {
        let mut arrived = Vec::new();
        let Textures { views, lock_step, device, queue, frame, .. } = self;
        match lock_step {
            None => {
                for state in views {
                    let Some(path) = &mut state.path else { continue };
                    while let Some(feedback) = path.readback.poll(device)? {
                        arrived.push(Feedback { view: state.view, ..feedback });
                    }
                }
                arrived.sort_by_key(|feedback| feedback.frame);
            }
            Some(lock_step) => {
                while let Some((frame, view)) = lock_step.due_feedback(*frame) {
                    let state = views.iter_mut().find(|state| state.view == view);
                    let path = state.and_then(|state| state.path.as_mut());
                    let readback = &mut path.ok_or(GpuError::NoFeedback { frame })?.readback;
                    arrived.push(Feedback { view, ..readback.wait(device, queue, frame)? });
                }
            }
        }
        arrived.append(&mut self.said);
        Ok(arrived)
    }

    /// The oldest frame of which some view's feedback has yet to come.
    pub(crate) fn oldest_feedback(&self) -> Option<u64> {
        self.views.iter().filter_map(ViewState::oldest).min()
    }

    /// Makes the bind groups of a texture anew, for every view; none while its pool's memory is given back.
    pub(crate) fn make_bind_groups(&mut self, texture: TextureId) {
        let number = usize::from(texture.number());
        let (Some(pool), Some(Some(state))) = (self.pagers.pool_of(texture), self.textures.get(number))
        else {
            return;
        };
        let pool = &self.pools[usize::from(pool.number())];
        for view in &mut self.views {
            view.groups.set(texture, pool.bind_groups(&self.device, &state.table, &view.params));
        }
    }

    /// Makes every view anew on another device. Bind groups are to be made again.
    pub(crate) fn restore_views(&mut self) {
        for place in 0..self.views.len() {
            let view = self.views[place].view;
            self.forget_feedback_path(view);
            let drawn = self.views[place].drawn;
            self.views[place] = ViewState { drawn, ..ViewState::new(&self.device, &self.queue, view) };
        }
    }

    /// Makes a view's path where there is none for pictures of this size.
    fn fit_feedback_path(&mut self, view: ViewId, picture: [u32; 2]) -> Result<(), Error> {
        let state = self.views.iter().find(|state| state.view == view);
        let fits = |path: &FeedbackPath| path.target.picture() == picture;
        if state.is_none_or(|state| state.path.as_ref().is_some_and(fits)) {
            return Ok(());
        }
        let is_coarse = view == ViewId::EXPECTED;
        let scale = if is_coarse { FeedbackScale::Coarse } else { FeedbackScale::Reduced };
        let target = FeedbackTarget::new(&self.device, picture, scale)?;
        let readback = Readback::new(&self.device, &target)?;
        self.forget_feedback_path(view);
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            state.path = Some(FeedbackPath { target, readback });
        }
        Ok(())
    }

    /// Gives up the feedback of a view that is under way.
    fn forget_feedback_path(&mut self, view: ViewId) {
        if let Some(lock_step) = &mut self.lock_step {
            lock_step.forget_feedback(view);
        }
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            self.counters.feedback_bytes_read += state.bytes_read();
            state.path = None;
        }
    }
}
