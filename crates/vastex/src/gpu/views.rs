//! Views: the main view and any beside it, and what each is drawn with.
//!
//! Each has a feedback target, a way back and a number of its own by which shaders know it, so that several
//! can be drawn in one encoder. How they say what they want is `feedback`'s business; what follows from it,
//! the pager decides.

use vastex_core::ViewId;
use vastex_wgpu::Views;

use super::Gpu;
use super::cycle::Cycle;
use super::feedback_path::FeedbackPath;

/// The number by which shaders know the main view.
pub(super) const MAIN: u32 = 0;

/// What there is on the GPU for a view.
pub(super) struct ViewState {
    pub(super) view: ViewId,
    /// By which shaders know it.
    pub(super) number: u32,
    pub(super) path: Option<FeedbackPath>,
    /// The jitter follows the view's own feedback, so that one that is not drawn in every frame shows all of
    /// its pixels too.
    pub(super) cycle: Cycle,
    /// The frame of the pass that the application has begun and not ended, if there is one, and its number in
    /// the cycle.
    pub(super) begun: Option<(u64, u64)>,
}

impl ViewState {
    pub(super) fn new(view: ViewId, number: u32) -> ViewState {
        ViewState { view, number, path: None, cycle: Cycle::default(), begun: None }
    }

    /// The oldest frame whose feedback has yet to come.
    pub(super) fn oldest(&self) -> Option<u64> {
        self.path.as_ref().and_then(|path| path.oldest())
    }

    /// Bytes of feedback brought back, since the target was made.
    pub(super) fn bytes_read(&self) -> u64 {
        self.path.as_ref().map_or(0, |path| path.bytes_read())
    }
}

impl Gpu {
    /// Makes what a view needs but its feedback target. What is only expected has the number of the main
    /// view, which is set anew wherever either is drawn.
    pub(crate) fn begin_view(&mut self, view: ViewId) {
        let is_free = |number: &u32| self.views.iter().all(|state| state.number != *number);
        let free = (1..Views::MOST).find(is_free);
        let number = free.filter(|_| view != ViewId::EXPECTED).unwrap_or(MAIN);
        self.views.push(ViewState::new(view, number));
    }

    /// The number by which shaders know a view; that of the main view where there is none.
    pub(crate) fn view_number(&self, view: ViewId) -> u32 {
        self.views.iter().find(|state| state.view == view).map_or(MAIN, |state| state.number)
    }

    pub(crate) fn has_view(&self, view: ViewId) -> bool {
        self.views.iter().any(|state| state.view == view)
    }

    pub(crate) fn remove_view(&mut self, view: ViewId) {
        self.forget_feedback_path(view);
        self.views.retain(|state| state.view != view);
    }

    /// A view has jumped: nothing of it has been seen.
    pub(crate) fn view_cut(&mut self, view: ViewId) {
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            state.cycle.begin_anew();
        }
    }

    /// Makes every view anew on another device.
    pub(super) fn restore_views(&mut self) {
        for place in 0..self.views.len() {
            let view = self.views[place].view;
            self.forget_feedback_path(view);
        }
        self.view_params = Views::new(&self.device, &self.queue, self.mode);
    }
}
