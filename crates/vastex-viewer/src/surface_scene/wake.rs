//! When the next frame is due.

use std::time::Duration;

use super::SurfaceScene;

/// When the next frame of a window is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake {
    /// At once.
    Now,
    /// After so long.
    After(Duration),
    /// When something happens to the window.
    OnEvent,
}

impl Wake {
    /// When the next frame of a window is due that shows nothing, or only waits for tiles to be tried again.
    pub const SLOWLY: Wake = Wake::After(Duration::from_millis(250));

    /// This, or in so long if that is earlier.
    pub fn no_later(self, pause: Duration) -> Wake {
        match self {
            Wake::Now => Wake::Now,
            Wake::After(before) => Wake::After(before.min(pause)),
            Wake::OnEvent => Wake::After(pause),
        }
    }
}

impl SurfaceScene {
    /// When the next frame is due. `awake` says that the view will change by itself, `in_its_place` when one
    /// is due of what the host shows in the scene's place, and `panels` in how long egui wants to run again.
    pub fn next_frame(&mut self, awake: bool, in_its_place: Option<Wake>, panels: Option<Duration>) -> Wake {
        let (stats, now) = (self.textures.stats(), self.beside.now());
        let is_hidden = self.beside.window.is_hidden;
        let at_rest = || self.beside.title.notice_left(now).map_or(Wake::OnEvent, Wake::After);
        let wake = match in_its_place {
            _ if is_hidden => Wake::SLOWLY,
            Some(wake) if !awake => wake,
            _ if self.is_empty() => at_rest(),
            // Each frame looks for answers, also where nothing moves.
            _ if awake || self.textures.pixels().asked() > 0 || self.display.next().is_some() => Wake::Now,
            _ if !self.is_settled(&stats) || self.beside.hud.is_due() => Wake::Now,
            _ if stats.pager.failed > 0 => Wake::SLOWLY,
            _ => at_rest(),
        };
        // What is said is seen in the next frame, and gone in the one after its time.
        let is_said = self.beside.title.notice() == self.beside.shown_notice.as_deref();
        let wake = if is_said { wake } else { Wake::Now };
        let wake = match panels {
            Some(due) if due.is_zero() => Wake::Now,
            Some(due) => wake.no_later(due),
            None => wake,
        };
        let others = [self.flickers_in(), self.below.due_in(now)];
        let wake = others.into_iter().flatten().filter(|_| !is_hidden).fold(wake, Wake::no_later);
        // A frame after an event follows no other without a pause.
        self.beside.set_busy(wake == Wake::Now);
        if self.beside.is_stale() { Wake::Now } else { wake }
    }
}
