//! What goes on while nothing changes: more pictures of what is seen, whose mean is a better one.

use super::picture::PanePicture;
use super::sight::PaneSight;
use super::{VolumePane, VolumeScene};

impl VolumeScene {
    /// Of how many pictures that of a pane is the mean: of several where nothing has changed for a while.
    pub fn passes(&self, pane: VolumePane) -> u32 {
        self.pictures[pane.number()].as_ref().map_or(1, PanePicture::passes)
    }

    /// Returns true if what is seen stays, so that more pictures of it make a better one.
    pub(super) fn is_resting(&self) -> bool {
        self.is_settled() && !self.is_playing
    }

    /// Returns true if such pictures are to come.
    pub(super) fn goes_on(&self) -> bool {
        let Some(renderer) = self.current.renderer().filter(|_| self.draws_parts && self.is_resting()) else {
            return false;
        };
        let panes = self.panes();
        panes.iter().any(|pane| {
            let key = self.key(&PaneSight::of(&self.look, &self.facts.of, &panes, pane));
            let picture = self.pictures[pane.pane.number()].as_ref();
            picture.is_some_and(|picture| !picture.is_rested(renderer, &key))
        })
    }
}
