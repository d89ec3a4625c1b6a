//! What stands beside a picture and over it, whether it is one of a scene or of a volume: the panel,
//! messages, the title, and what the machine does; and what there is to say and to do about it.

use std::sync::Arc;
use std::time::Duration;

use super::hud::SceneHud;
use crate::layers::Ground;
use crate::panels::{Messages, WindowAsked, WindowPanel};
use crate::title::Title;

/// A clock: the time since the host began.
pub type SceneClock = Arc<dyn Fn() -> Duration + Send + Sync>;

/// How a window is at the moment, as its host says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WindowState {
    /// True if the pointer is over a panel.
    pub is_over_panel: bool,
    /// True if the window fills the screen.
    pub fills_screen: bool,
    /// True if panels are dark.
    pub is_dark: bool,
    /// True if nobody sees the window.
    pub is_hidden: bool,
}

/// What stands beside a picture and over it.
pub struct Beside {
    /// The panel.
    pub panel: WindowPanel,
    /// What went wrong and what there is to know, until it is read.
    pub messages: Messages,
    /// The title of the window.
    pub title: Title,
    /// What the machine does.
    pub hud: SceneHud,
    /// How the window is; the host keeps it true.
    pub window: WindowState,
    /// Name of the file that is being opened, and how much of it is done, 0 to 1.
    pub opening: Option<(String, f64)>,
    /// The notice that the last frame showed.
    pub shown_notice: Option<String>,
    /// True if it was told of what is displayed that a pool is too small: that is told once.
    pub shortage_is_told: bool,
    /// What was asked for in the panel and is the host's to do.
    pub asked: Vec<WindowAsked>,
    clock: SceneClock,
    said: Vec<String>,
    is_stale: bool,
    /// When the last frame was drawn, and whether the next follows without a pause.
    drawn_at: Option<Duration>,
    is_busy: bool,
}

impl Beside {
    pub(super) fn new(clock: SceneClock) -> Beside {
        Beside {
            panel: WindowPanel::default(),
            messages: Messages::default(),
            title: Title::default(),
            hud: SceneHud::default(),
            window: WindowState::default(),
            opening: None,
            shown_notice: None,
            shortage_is_told: false,
            asked: Vec::new(),
            clock,
            said: Vec::new(),
            is_stale: false,
            drawn_at: None,
            is_busy: false,
        }
    }

    /// The time since the host began.
    pub fn now(&self) -> Duration {
        (self.clock)()
    }

    /// Says something outside the window, where the host says such things.
    pub fn say(&mut self, said: String) {
        self.said.push(said);
    }

    /// What is to be said outside the window since the last call.
    pub fn take_said(&mut self) -> Vec<String> {
        std::mem::take(&mut self.said)
    }

    /// Says something to the person at the window, in its title alone.
    pub fn notify(&mut self, notice: &str) {
        self.title.notify(notice.to_owned(), (self.clock)());
    }

    /// Says what went wrong, in the window until it is read; a second message of a topic takes the place of
    /// the first.
    pub fn tell(&mut self, topic: &str, message: &str) {
        self.messages.add(topic, message);
        self.is_stale = true;
    }

    /// Tells what there is to know of a file, in the window until it is read or another file is displayed.
    pub fn note(&mut self, note: &str) {
        self.messages.note("file", note);
        self.is_stale = true;
    }

    /// A frame is due, since what is shown is another.
    pub fn refresh(&mut self) {
        self.is_stale = true;
    }

    /// Returns true if a frame is due, since what is shown is another than in the last one.
    pub(super) fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// A frame begins, which shows what there is. Returns true if it was due for that.
    pub fn take_stale(&mut self) -> bool {
        std::mem::take(&mut self.is_stale)
    }

    /// Returns true if a frame was due at once after the last one: then nobody slept between both.
    pub fn is_busy(&self) -> bool {
        self.is_busy
    }

    pub(super) fn set_busy(&mut self, is_busy: bool) {
        self.is_busy = is_busy;
    }

    /// A frame is being drawn: it counts for the title and for what the machine does, unless there was a
    /// pause before it. Gives the time since the last one, if there was one.
    pub fn count_frame(&mut self) -> Option<Duration> {
        let now = self.now();
        let since = now.saturating_sub(self.drawn_at.replace(now)?);
        if self.is_busy {
            self.title.count_frame(since);
            self.hud.frames.push(since);
        }
        Some(since)
    }

    /// What a picture lies on.
    pub fn ground(&self) -> Ground {
        self.panel.ground.beside(self.window.is_dark)
    }
}
