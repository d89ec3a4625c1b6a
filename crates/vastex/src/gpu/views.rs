//! Views: the main view and any beside it, and what each is drawn with.
//!
//! Each has a feedback target, a way back and a number of its own by which shaders know it, so that several
//! can be drawn in one encoder. How they say what they want is `feedback`'s business; what follows from it,
//! the pager decides.

use vastex_core::ViewId;
use vastex_core::shader_constants::{JITTER_CYCLE, RAY_ANSWERS, RAY_TURNS};
use vastex_wgpu::{FeedbackMode, FeedbackPass, FeedbackView, Views};

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
    /// The passes in which gaps are looked for.
    gaps: Cycle,
    /// True if it is said to rest: then it is seen whole when its gaps were looked for at all pixels.
    rests: bool,
    /// Of how many bricks that a ray lacks the next pass names one, if it looks for gaps.
    seeks: Option<u32>,
    /// Frames whose feedback is to come and is of gaps, whatever has become of the view since.
    of_gaps: Vec<u64>,
    /// An upper estimate of the bricks that a ray of the view's shaders meets; 0 where it shows surfaces.
    pub(super) bricks_of_a_ray: u32,
    /// The frame of the pass that the application has begun and not ended, if there is one, and what it looks
    /// at.
    pub(super) begun: Option<(u64, FeedbackPass)>,
}

impl ViewState {
    pub(super) fn new(view: ViewId, number: u32) -> ViewState {
        let (path, cycle, gaps, of_gaps, bricks_of_a_ray, begun) = Default::default();
        let (rests, seeks) = (false, None);
        ViewState { view, number, path, cycle, gaps, rests, seeks, of_gaps, bricks_of_a_ray, begun }
    }

    /// What its next pass looks at.
    pub(super) fn look(&self) -> FeedbackPass {
        match self.seeks {
            Some(turns) => FeedbackPass::Gaps { pass: self.gaps.pass(), turns },
            None => FeedbackPass::Cycle(self.cycle.pass()),
        }
    }

    /// The feedback of such a pass is on its way, as that of a frame.
    pub(super) fn record(&mut self, frame: u64, look: FeedbackPass) {
        match look {
            FeedbackPass::Cycle(pass) => self.cycle.record(frame, pass),
            FeedbackPass::Gaps { pass, .. } => {
                self.gaps.record(frame, pass);
                self.of_gaps.push(frame);
            }
        }
    }

    /// A frame's feedback has come, where others are seen whole in `cycle`; says whether it is one of gaps.
    pub(super) fn come(&mut self, frame: u64, cycle: u32) -> bool {
        let is_of_gaps = self.forget_gaps(frame);
        match is_of_gaps {
            true => self.gaps.come(frame, self.gap_passes().into()),
            false => self.cycle.come(frame, self.length(cycle)),
        }
        is_of_gaps
    }

    /// A frame's feedback will not come.
    pub(super) fn lose(&mut self, frame: u64) {
        self.forget_gaps(frame);
        self.cycle.lose(frame);
        self.gaps.lose(frame);
    }

    /// Returns true if the feedback of a frame, which is not waited for any more, is of gaps.
    fn forget_gaps(&mut self, frame: u64) -> bool {
        let before = self.of_gaps.len();
        self.of_gaps.retain(|of| *of != frame);
        self.of_gaps.len() < before
    }

    pub(super) fn begin_anew(&mut self) {
        self.cycle.begin_anew();
        self.gaps.begin_anew();
        self.seeks = None;
    }

    /// Feedbacks in which all of its pixels are looked at for gaps.
    fn gap_passes(&self) -> u32 {
        FeedbackView::gap_passes(self.answers())
    }

    /// Returns true if it was seen whole, or is not drawn: at every sample position, and where it rests at
    /// all pixels, however many turns rays take.
    pub(super) fn is_seen_whole(&self, frame: u64, cycle: u32) -> bool {
        let length = self.length(cycle);
        let is_drawn = self.cycle.is_drawn(frame, length) || self.gaps.is_drawn(frame, length);
        !is_drawn
            || match self.rests {
                true => self.is_seen_once(cycle) && self.gaps.has_seen_all(self.gap_passes().into()),
                false => self.cycle.has_seen_all(length),
            }
    }

    /// Returns true if it was seen at every sample position, whatever rays have yet to ask for there.
    fn is_seen_once(&self, cycle: u32) -> bool {
        self.cycle.has_seen_positions(self.length(cycle), JITTER_CYCLE.into())
    }

    /// Answers of each block of its feedback target.
    pub(super) fn answers(&self) -> u32 {
        answers(self.bricks_of_a_ray)
    }

    /// Jitter cycles until every ray has asked for every brick that it meets.
    fn turns(&self) -> u32 {
        self.bricks_of_a_ray.div_ceil(self.answers()).clamp(1, RAY_TURNS)
    }

    /// Feedbacks in which it is seen whole, where others are in `cycle`.
    pub(super) fn length(&self, cycle: u32) -> u64 {
        u64::from(cycle.max(JITTER_CYCLE * self.turns()))
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

/// Answers of each block where a ray meets so many bricks.
fn answers(bricks: u32) -> u32 {
    bricks.clamp(1, RAY_ANSWERS).next_power_of_two()
}

impl Gpu {
    /// Says how many bricks a ray of a view meets; 0 where it shows surfaces. Returns true if there is such a
    /// view.
    pub(crate) fn set_bricks_of_a_ray(&mut self, view: ViewId, bricks: u32) -> bool {
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return false };
        let before = std::mem::replace(&mut state.bricks_of_a_ray, bricks);
        // Where pictures say what they want, those of rays do not.
        if self.mode == FeedbackMode::Inline && (before == 0) != (bricks == 0) {
            self.forget_feedback_path(view);
        }
        true
    }

    /// Notes that a view of rays rests, or does not; returns in how many passes all of its pixels are looked
    /// at for gaps, 0 where they are not. To be said again where it says otherwise how many bricks a ray
    /// meets.
    pub(crate) fn set_resting(&mut self, view: ViewId, rests: bool) -> u32 {
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return 0 };
        let rests = rests && state.bricks_of_a_ray > 0;
        if std::mem::replace(&mut state.rests, rests) != rests {
            state.gaps.begin_anew();
            state.seeks = None;
        }
        if rests { state.gap_passes() } else { 0 }
    }

    /// Returns true if a view was said to rest.
    pub(crate) fn rests(&self, view: ViewId) -> bool {
        self.views.iter().any(|state| state.view == view && state.rests)
    }

    /// Has the next passes of the views that rest look for gaps where `looks` says of how many bricks that a
    /// ray lacks it names one, of those that were seen at every sample position in `cycle` frames.
    pub(crate) fn look_for_gaps(&mut self, cycle: u32, mut looks: impl FnMut(ViewId) -> Option<u32>) {
        for state in self.views.iter_mut().filter(|state| state.rests) {
            state.seeks = if state.is_seen_once(cycle) { looks(state.view) } else { None };
        }
    }

    /// Jitter cycles until every ray of a view has asked for every brick that it meets.
    pub(crate) fn turns_of(&self, view: ViewId) -> u32 {
        self.views.iter().find(|state| state.view == view).map_or(1, ViewState::turns)
    }

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
            state.begin_anew();
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
