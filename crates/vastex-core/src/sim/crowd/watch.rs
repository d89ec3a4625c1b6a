//! Who looks at a crowd: the main view in every frame, others beside it as often as they like.

use crate::sim::crowd::{Crowd, Member};
use crate::wanted::feedback::Feedback;
use crate::wanted::view::{ViewError, ViewId};

/// Frames between a view and its feedback.
const FEEDBACK_FRAMES: u64 = 2;

/// A view of the crowd beside the main one.
#[derive(Debug)]
pub(super) struct Beside {
    view: ViewId,
    watch: Watch,
}

/// How a view beside the main one looks at a crowd.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watch {
    /// The view's cameras are so many frames ahead on their paths.
    pub ahead: u64,
    /// The view is drawn every so many frames; never where 0.
    pub every: u64,
}

impl Crowd {
    /// Adds a view, to which all textures look as `watch` says.
    pub fn add_view(&mut self, weight: f32, watch: Watch) -> Result<ViewId, ViewError> {
        let view = self.pager.add_view(weight)?;
        self.beside.push(Beside { view, watch });
        Ok(view)
    }

    /// Changes how a view looks at the crowd; `cut` says so to the pager.
    pub fn change_view(&mut self, view: ViewId, watch: Watch, cut: bool) {
        self.beside.iter_mut().filter(|beside| beside.view == view).for_each(|beside| beside.watch = watch);
        if cut {
            self.pager.view_cut(view, self.frame + 1);
        }
    }

    /// Removes a view.
    pub fn remove_view(&mut self, view: ViewId) {
        self.pager.remove_view(view);
        self.beside.retain(|beside| beside.view != view);
        self.newest.remove(&view);
    }

    /// The views beside the main one.
    pub fn views_beside(&self) -> impl Iterator<Item = ViewId> + '_ {
        self.beside.iter().map(|beside| beside.view)
    }

    /// Draws the views whose turn it is.
    pub(super) fn see(&mut self) {
        let at = self.held.unwrap_or(self.frame);
        let main = self.seen(ViewId::MAIN, at, self.frame);
        self.in_view.push_back(main);
        for nth in 0..self.beside.len() {
            let Beside { view, watch: Watch { ahead, every } } = self.beside[nth];
            if every > 0 && self.frame.is_multiple_of(every) {
                let seen = self.seen(view, at + ahead, self.frame / every);
                self.in_view.push_back(seen);
            }
        }
    }

    /// What all cameras of a view want together, `at` frames along their paths, as the view's so-manieth
    /// feedback.
    fn seen(&self, view: ViewId, at: u64, drawn: u64) -> Feedback {
        let mut all = Feedback { view, frame: self.frame, ..Feedback::default() };
        for Member { texture, geometry, path, .. } in &self.members {
            let seen = path.view(at).feedback(*texture, geometry, self.screen, drawn, false);
            all.pages.extend(seen.pages);
        }
        for (group, path) in &self.groups {
            let Some(shape) = self.pager.group_shape(*group) else { continue };
            let seen = path.view(at).feedback(group.number(), shape, self.screen, drawn, false);
            all.pages.extend(seen.pages);
        }
        all.pages.sort_unstable();
        all
    }

    /// The feedback that is due, of all views that were drawn in its frame.
    pub(super) fn observe(&mut self) {
        let is_due = |feedback: &mut Feedback| feedback.frame + FEEDBACK_FRAMES <= self.frame;
        let due: Vec<Feedback> = std::iter::from_fn(|| self.in_view.pop_front_if(is_due)).collect();
        self.pager.observe_views(&due);
        let is_there = |feedback: &Feedback| self.pager.knows(feedback);
        let newest = due.iter().filter(|feedback| is_there(feedback));
        let newest = newest.map(|feedback| (feedback.view, self.pager.of_members(feedback)));
        self.newest.extend(newest);
    }
}
