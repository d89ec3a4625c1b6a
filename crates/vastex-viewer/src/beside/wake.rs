//! When the next frame is due.

use std::time::Duration;

use super::Beside;

/// When the next frame of a window is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wake {
    /// At once.
    Now,
    /// After so long.
    After(Duration),
    /// After so long, and nobody is to see it: the picture is the one that is there. The host draws it by
    /// [`WindowScene::draw_unseen`](crate::window_scene::WindowScene::draw_unseen) alone.
    Unseen(Duration),
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
            Wake::Unseen(before) if before <= pause => self,
            Wake::Unseen(_) => Wake::After(pause),
            Wake::OnEvent => Wake::After(pause),
        }
    }
}

impl Beside {
    /// When the next frame of a picture is due that rests: once what is said is to be seen no more.
    pub(crate) fn at_rest(&self) -> Wake {
        self.title.notice_left(self.now()).map_or(Wake::OnEvent, Wake::After)
    }

    /// What is left of a pause since the last frame.
    pub(crate) fn due_after(&self, pause: Duration) -> Duration {
        let since = |drawn| self.now().saturating_sub(drawn);
        pause.saturating_sub(self.drawn_at.map_or(pause, since))
    }

    /// When the next frame is due, where one of the picture is due by `wake`. What is said, panels, which
    /// want to run again in so long, and the picture `for_itself`, in so long where somebody sees it, may
    /// need one earlier.
    pub(crate) fn next_frame(
        &mut self,
        wake: Wake,
        panels: Option<Duration>,
        for_itself: impl IntoIterator<Item = Duration>,
    ) -> Wake {
        let is_hidden = self.is_hidden;
        let wake = if is_hidden { Wake::SLOWLY } else { wake };
        // What is said is seen in the next frame, and gone in the one after its time.
        let wake = if self.has_another_notice() { Wake::Now } else { wake };
        let wake = match panels {
            Some(due) if due.is_zero() => Wake::Now,
            Some(due) => wake.no_later(due),
            None => wake,
        };
        let wake = for_itself.into_iter().filter(|_| !is_hidden).fold(wake, Wake::no_later);
        // A frame after an event follows no other without a pause.
        self.set_busy(wake == Wake::Now);
        if self.is_stale() { Wake::Now } else { wake }
    }
}
