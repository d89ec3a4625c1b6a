//! When the next frame is due.

use std::time::Duration;

use super::SurfaceScene;
use crate::beside::Wake;

impl SurfaceScene {
    /// When the next frame is due. `awake` says that the view will change by itself, and `panels` in how long
    /// egui wants to run again.
    pub fn next_frame(&mut self, awake: bool, panels: Option<Duration>) -> Wake {
        let stats = self.textures.stats();
        let wake = match () {
            () if self.is_empty() => self.beside.at_rest(),
            // Each frame looks for answers, also where nothing moves.
            () if awake || self.textures.pixels().asked() > 0 || self.display.next().is_some() => Wake::Now,
            () if !self.is_settled(&stats) => self.unsettled_wake(&stats),
            () if self.owes_picture() || self.beside.hud.is_due() => Wake::Now,
            () if stats.pager.failed > 0 => Wake::SLOWLY,
            () => self.beside.at_rest(),
        };
        let others = [self.flickers_in(), self.below.due_in(self.beside.now())];
        self.beside.next_frame(wake, panels, others.into_iter().flatten())
    }
}
