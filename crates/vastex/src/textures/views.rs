//! Views: the main view and any beside it.
//!
//! Each has a feedback target, a way back and a number of its own, so that several can be drawn in one encoder.

use vastex_core::ViewId;

use super::Textures;
use crate::error::Error;

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

impl Textures {
    /// Adds a view beside the main one: a mirror, a shadow, a second eye, a second window. What any view wants is loaded.
    ///
    /// Costs, once it is drawn, a feedback target. Shaders know it by its [number](Textures::view_number).
    pub fn add_view(&mut self, settings: ViewSettings) -> Result<ViewId, Error> {
        let view = self.paging.add_view(settings.weight)?;
        self.gpu.begin_view(view);
        Ok(view)
    }

    /// Sets how much a pixel of a view counts, from its next feedback on; see [`ViewSettings::weight`]. Says whether there is
    /// such a view.
    pub fn set_view_weight(&mut self, view: ViewId, weight: f32) -> bool {
        self.paging.set_view_weight(view, weight)
    }

    /// Removes a view: what only it wanted is out of view. Says whether there was one; the main view stays.
    pub fn remove_view(&mut self, view: ViewId) -> bool {
        let was_there = self.paging.remove_view(view);
        if was_there {
            self.gpu.remove_view(view);
        }
        was_there
    }

    /// The main view has jumped: what it wanted before says nothing of what it wants from this frame on.
    pub fn view_cut(&mut self) {
        self.view_cut_of(ViewId::MAIN);
    }

    /// A view has jumped. What the others want stays.
    pub fn view_cut_of(&mut self, view: ViewId) {
        self.paging.view_cut(view);
        self.gpu.view_cut(view);
    }
}
