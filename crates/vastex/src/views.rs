//! Views: the main view and any beside it, and what each is drawn with.
//!
//! Each has a feedback target, a way back, a uniform and bind groups of its own, so that several can be drawn in one encoder.
//! How they say what they want is `feedback`'s business; what follows from it, the pager decides.

use vastex_core::{TextureId, ViewId};
use vastex_wgpu::{FeedbackWay, ViewBuffer};

use crate::cycle::Cycle;
use crate::error::Error;
use crate::feedback::FeedbackPath;
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
    pub(crate) path: Option<FeedbackPath>,
    /// The jitter follows the view's own feedback, so that one that is not drawn in every frame shows all of its pixels too.
    pub(crate) cycle: Cycle,
}

impl ViewState {
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        view: ViewId,
        way: FeedbackWay,
    ) -> ViewState {
        let (params, groups) = (ViewBuffer::new(device, queue, way), BindGroups::default());
        ViewState { view, params, groups, path: None, cycle: Cycle::default() }
    }

    /// The oldest frame whose feedback has yet to come.
    pub(crate) fn oldest(&self) -> Option<u64> {
        self.path.as_ref().and_then(|path| path.oldest())
    }

    /// Bytes of feedback brought back, since the target was made.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.path.as_ref().map_or(0, |path| path.bytes_read())
    }
}

impl Textures {
    /// Adds a view beside the main one: a mirror, a shadow, a second eye, a second window. What any view wants is loaded.
    ///
    /// Costs a bind group for each layer of each texture and for each group, and once it is drawn a feedback target.
    pub fn add_view(&mut self, settings: ViewSettings) -> Result<ViewId, Error> {
        self.catch_up()?;
        let view = self.pager.add_view(settings.weight)?;
        self.begin_view(view);
        Ok(view)
    }

    /// Makes what a view needs but its feedback target.
    pub(crate) fn begin_view(&mut self, view: ViewId) {
        self.views.push(ViewState::new(&self.device, &self.queue, view, self.way));
        self.make_all_bind_groups();
    }

    /// Sets how much a pixel of a view counts, from its next feedback on; see [`ViewSettings::weight`]. Says whether there is
    /// such a view.
    pub fn set_view_weight(&mut self, view: ViewId, weight: f32) -> bool {
        self.pager.set_weight(view, weight)
    }

    /// Removes a view: what only it wanted is out of view. Says whether there was one; the main view stays.
    pub fn remove_view(&mut self, view: ViewId) -> bool {
        let was_there = self.pager.remove_view(view);
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
        self.pager.view_cut(view, self.frame);
        if let Some(state) = self.views.iter_mut().find(|state| state.view == view) {
            state.cycle.begin_anew();
        }
    }

    /// Makes every bind group of every view anew.
    pub(crate) fn make_all_bind_groups(&mut self) {
        let textures: Vec<TextureId> = self.iter().collect();
        textures.into_iter().for_each(|texture| self.make_bind_groups(texture));
        self.bind_groups_anew();
    }

    /// Makes the bind groups of a texture anew, for every view; none while its pool's memory is given back.
    pub(crate) fn make_bind_groups(&mut self, texture: TextureId) {
        let number = usize::from(texture.number());
        let (Some(pool), Some(Some(state))) = (self.pager.pool_of(texture), self.textures.get(number)) else {
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
            let cycle = std::mem::take(&mut self.views[place].cycle);
            self.views[place] =
                ViewState { cycle, ..ViewState::new(&self.device, &self.queue, view, self.way) };
        }
    }
}
