//! What of a window another device or another file has to have again, and textures that take the place of
//! others.

use vastex::{Region, Textures};

use super::SurfaceScene;
use super::displayed::{Blueprint, DisplaySettings, Displayed};
use super::source::DisplayError;

impl SurfaceScene {
    /// Pools have the sizes and rules again that a person chose.
    pub(super) fn change_pools_again(&mut self) {
        for (kind, error) in self.beside.chosen.pools().give(&mut self.textures) {
            // It is said once.
            self.beside.chosen.give_size_up(&kind);
            self.announce(&format!("a pool of {kind} keeps its size: {error}"));
        }
    }

    /// What the displayed source is made of, so that the same can be made in other textures; `None` if
    /// nothing is displayed. A source that waits behind its preview is displayed at once.
    pub fn blueprint(&mut self) -> Option<Blueprint> {
        self.finish_taking_over();
        self.display.displayed().map(|displayed| displayed.blueprint(&self.textures))
    }

    /// Has other textures take the place of these from the next frame on, with what was made in them with
    /// these settings of what is displayed. Gives them back if something else is displayed by now.
    pub fn exchange(
        &mut self,
        (mut textures, mut displayed): (Textures, Option<Displayed>),
        before: &DisplaySettings,
    ) -> Result<bool, DisplayError> {
        self.finish_taking_over();
        let is_same = match (&displayed, self.display.displayed()) {
            (Some(made), Some(displayed)) => made.is_of(displayed),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            return Ok(false);
        }
        if let Some(displayed) = &mut displayed {
            displayed.become_like(&self.gpu, &mut textures, before, &self.settings)?;
            displayed.catch_up(&mut textures)?;
        }
        let of_window = self.textures.inspect().settings();
        let (uploads, in_flight) = (of_window.upload_bytes_per_frame, of_window.in_flight_bytes);
        textures.memory().set_budgets(uploads, in_flight);
        let gone = displayed.and_then(|displayed| self.display.exchange(displayed));
        let before = std::mem::replace(&mut self.textures, textures);
        // What was made for textures goes before them.
        drop((gone, before));
        self.beside.hud.forget_textures();
        self.to_tell.clear();
        (self.values, self.beside.shortage_is_said) = (None, false);
        self.minimaps.clear();
        self.change_pools_again();
        if self.textures.inspect().settings().picture != self.size {
            self.fit_pools();
        }
        self.beside.forget("feedback");
        self.wanted_feedback = None;
        let mode = self.textures.inspect().feedback_mode();
        self.beside.chosen.set_feedback(mode);
        self.beside.notify(&format!("feedback: {}", mode.name()));
        self.wake();
        self.beside.refresh();
        Ok(true)
    }

    /// Reads all of what is displayed again, since its file is another than it was.
    pub fn read_again(&mut self) -> Result<(), vastex::Error> {
        let shown = [self.display.displayed(), self.display.next()];
        let textures: Vec<_> = shown.into_iter().flatten().flat_map(Displayed::textures).collect();
        for texture in textures {
            self.textures.texture_mut(texture)?.invalidate(&Region::whole());
        }
        self.wake();
        Ok(())
    }
}
