//! What stands beside a picture and over it, whether it is one of surfaces or of a volume (feature `egui`):
//! the panel, messages, the title, and what the machine does; and what there is to say and to do about it.
//!
//! There are five ways to say something. [`Beside::notify`] shows a notice at the foot of the picture and in
//! the title, for some seconds. [`Beside::show_error`] and [`Beside::show_note`] show a message over the
//! picture that stays until it is dismissed or no longer holds, and [`Beside::show_error_later`] one that
//! waits for a frame that is due for something else. [`Beside::log`] says a line outside the window, where
//! the host writes such lines; what concerns a script as well as a person is said by it and by one of the
//! others.

mod hud;
mod tuning;
mod wake;

use std::ffi::OsStr;
use std::ops::RangeInclusive;
use std::time::Duration;

use crate::hud::Chosen;
use crate::input::Action;
use crate::layers::Ground;
use crate::panels::{Messages, OfferedImages, WindowAsked, WindowPanel};
use crate::remembered::Remembered;
use crate::stage::{Clock, PartTime};
use crate::title::Title;
pub(crate) use hud::{SceneHud, SmallOverlays};
pub(crate) use tuning::{Sampling, Tuned};
pub use wake::Wake;

/// What is said of tiles and bricks that cannot be read, as a topic.
pub const TILES: &str = "tiles";
/// What else is said of a volume, as a topic.
pub const VOLUME: &str = "volume";
/// What is said of rays that are cut, as a topic.
pub(crate) const CUT: &str = "rays that are cut";

/// From one frame to the next on a display of 60 a second, in whole milliseconds.
const USUAL_FRAME_PAUSE: Duration = Duration::from_millis(16);
/// Frames in 1000 seconds that a display may say it has; what says anything else has no display behind it.
const REFRESH_RATES: RangeInclusive<u32> = 20_000..=1_000_000;

/// How a window is at the moment, as its host says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WindowState {
    /// True if the pointer is over a panel.
    pub is_over_panel: bool,
    /// True if the window fills the screen.
    pub fills_screen: bool,
    /// True if panels are dark.
    pub is_dark: bool,
    /// True if files that are dropped onto it do not reach it, as under Wayland.
    pub lacks_drops: bool,
}

/// What stands beside a picture and over it.
pub struct Beside {
    pub(crate) panel: WindowPanel,
    /// What went wrong and what there is to know, until it is read.
    pub(crate) messages: Messages,
    pub(crate) title: Title,
    /// What the machine does.
    pub(crate) hud: SceneHud,
    /// How textures are sampled and kept, as a person chose.
    pub(crate) chosen: Chosen,
    pub(crate) window: WindowState,
    /// True if nobody sees the window.
    pub(crate) is_hidden: bool,
    /// Name of the file that is being opened, and how much of it is done, 0 to 1.
    pub(crate) opening: Option<(String, f64)>,
    /// The notice that the last frame showed.
    pub(crate) shown_notice: Option<String>,
    /// True if it was said of what is displayed that a pool is too small: that is said once.
    pub(crate) shortage_is_said: bool,
    /// What was asked for in the panel and is the host's to do.
    pub(crate) asked: Vec<WindowAsked>,
    clock: Clock,
    logged: Vec<String>,
    is_stale: bool,
    /// How often all notes were forgotten.
    times_forgotten: u64,
    /// When the last frame was drawn, and whether the next follows without a pause.
    drawn_at: Option<Duration>,
    is_busy: bool,
    /// From one frame of the display to the next.
    pub(crate) frame_pause: Duration,
    /// True if nobody saw the last frame.
    follows_unseen: bool,
}

impl Beside {
    pub(crate) fn new(chosen: Chosen, clock: Clock) -> Beside {
        Beside {
            panel: WindowPanel::default(),
            messages: Messages::default(),
            title: Title::default(),
            hud: SceneHud::new(),
            chosen,
            window: WindowState::default(),
            is_hidden: false,
            opening: None,
            shown_notice: None,
            shortage_is_said: false,
            asked: Vec::new(),
            clock,
            logged: Vec::new(),
            is_stale: false,
            times_forgotten: 0,
            drawn_at: None,
            is_busy: false,
            frame_pause: USUAL_FRAME_PAUSE,
            follows_unseen: false,
        }
    }

    /// The time since the host began.
    pub fn now(&self) -> Duration {
        (self.clock)()
    }

    /// The host's clock.
    pub(crate) fn clock(&self) -> Clock {
        self.clock.clone()
    }

    /// Says a line outside the window, where the host writes such lines.
    pub fn log(&mut self, line: String) {
        self.logged.push(line);
    }

    /// The lines that are to be written outside the window since the last call.
    pub fn take_log(&mut self) -> Vec<String> {
        std::mem::take(&mut self.logged)
    }

    /// Says something for some seconds, at the foot of the picture and in the title.
    pub fn notify(&mut self, notice: &str) {
        self.title.notify(notice.to_owned(), (self.clock)());
    }

    /// Says what went wrong, until it is dismissed or forgotten. A second message of a topic takes the place
    /// of the first.
    pub fn show_error(&mut self, topic: &str, message: &str) {
        self.messages.add_error(topic, message);
        self.is_stale = true;
    }

    /// Says what went wrong as [`Beside::show_error`] does, in the next frame that is due for something else:
    /// such errors may come with each frame.
    pub fn show_error_later(&mut self, topic: &str, message: &str) {
        self.messages.add_error(topic, message);
    }

    /// Says what there is to know, until it is dismissed or forgotten. A second note of a topic stands below
    /// the first.
    pub fn show_note(&mut self, topic: &str, note: &str) {
        self.messages.add_note(topic, note);
        self.is_stale = true;
    }

    /// What was said of a topic no longer holds. Returns true if anything was.
    pub fn forget(&mut self, topic: &str) -> bool {
        self.messages.forget(topic)
    }

    /// No note concerns what is shown from here on.
    pub fn forget_notes(&mut self) {
        self.messages.forget_notes();
        self.times_forgotten += 1;
    }

    /// How often all notes were forgotten: what still holds is said again after that.
    pub(crate) fn times_forgotten(&self) -> u64 {
        self.times_forgotten
    }

    /// Returns true if it was said of what is displayed that a pool is too small.
    pub fn shortage_is_said(&self) -> bool {
        self.shortage_is_said
    }

    /// That a pool is too small is said now, and not again of what is displayed.
    pub fn note_shortage_said(&mut self) {
        self.shortage_is_said = true;
    }

    /// The panel, as a person left it.
    pub fn panel(&self) -> &WindowPanel {
        &self.panel
    }

    /// Opens the panel.
    pub fn open_panel(&mut self) {
        self.panel.open();
    }

    /// Opens the panel, with the keys in the field for a path.
    pub fn ask_for_path(&mut self) {
        self.panel.ask_for_path();
    }

    /// Offers images that something lists, for a person to choose from: in the panel, which opens where
    /// something is displayed, else in the middle of the window.
    pub fn offer_images(&mut self, images: OfferedImages, is_empty: bool) {
        self.panel.offer(images);
        if !is_empty {
            self.panel.open();
        }
        self.is_stale = true;
    }

    /// What a path opens is displayed: unless that is one of the images that are offered, these are offered
    /// no more.
    pub fn turn_to(&mut self, path: &OsStr) {
        self.panel.turn_to(path);
    }

    /// Hides the list of keys. Returns true if it was shown.
    pub fn hide_keys(&mut self) -> bool {
        self.panel.hide_keys()
    }

    /// Carries out an action that is of what stands beside a picture. Returns true if it is. The line at the
    /// foot of the picture may have its place also where nothing else stands there.
    pub(crate) fn perform(&mut self, action: &Action, line_has_place: bool) -> bool {
        match action {
            Action::Panel => self.panel.open_or_close(),
            Action::About => self.panel.show_about(),
            Action::Hud => self.show_or_hide_hud(),
            Action::Guides => self.panel.show_or_hide_guides(),
            Action::Values => self.panel.show_or_hide_values(self.window.fills_screen || line_has_place),
            Action::Keys => self.panel.show_or_hide_keys(),
            _ => return false,
        }
        true
    }

    /// What a person asked for in the panel since the last call, and is the host's to do.
    pub fn take_asked(&mut self) -> Vec<WindowAsked> {
        std::mem::take(&mut self.asked)
    }

    /// What a person chose of how textures are sampled and kept.
    pub fn chosen(&self) -> &Chosen {
        &self.chosen
    }

    /// Returns true if what the machine does is shown.
    pub fn hud_is_shown(&self) -> bool {
        self.hud.is_shown()
    }

    /// Sets what the GPU took for the parts of a frame; `None` if it does not tell.
    pub fn set_gpu_times(&mut self, times: Option<Vec<PartTime>>) {
        self.hud.gpu_times = times;
    }

    /// Shows everything as when the window was closed last.
    pub fn show_as_before(&mut self, before: &Remembered) {
        self.panel.show_as_before(before);
        self.hud.show_as_before(before.hud_is_shown);
    }

    /// A window with what is shown here now, and what was chosen.
    pub fn remembered(&self, window: &Remembered) -> Remembered {
        Remembered {
            panel_is_open: self.panel.is_open(),
            guides_are_hidden: !self.panel.guides_are_shown(),
            values_are_hidden: !self.panel.values_are_shown(),
            hud_is_shown: self.hud.is_shown(),
            ground: self.panel.ground,
            ..self.chosen.remembered(window)
        }
    }

    /// How the window is from here on.
    pub fn set_window(&mut self, window: WindowState) {
        self.window = window;
        self.panel.lacks_drops = window.lacks_drops;
    }

    /// The display shows so many frames in 1000 seconds from here on; `None` if nobody knows, which counts as
    /// 60 a second. Frames that nobody sees ([`Wake::Unseen`]) come as often, like those that are seen.
    pub fn set_refresh_rate(&mut self, millihertz: Option<u32>) {
        let pause = |rate: u32| Duration::from_secs(1000) / rate;
        self.frame_pause =
            millihertz.filter(|rate| REFRESH_RATES.contains(rate)).map_or(USUAL_FRAME_PAUSE, pause);
    }

    /// Nobody sees the window from here on, or somebody does.
    pub fn set_hidden(&mut self, is_hidden: bool) {
        self.is_hidden = is_hidden;
    }

    /// A frame is due, since what is shown is another.
    pub fn refresh(&mut self) {
        self.is_stale = true;
    }

    /// Returns true if a frame is due, since what is shown is another than in the last one.
    pub(crate) fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// A frame begins, which shows what there is. Returns true if it was due for that.
    pub(crate) fn take_stale(&mut self) -> bool {
        std::mem::take(&mut self.is_stale)
    }

    /// Returns true if a notice is to be seen that the last frame did not show, or the other way round.
    pub(crate) fn has_another_notice(&self) -> bool {
        self.title.notice() != self.shown_notice.as_deref()
    }

    /// Returns true if a frame was due at once after the last one, which somebody saw: then nobody slept
    /// between both.
    pub fn is_busy(&self) -> bool {
        self.is_busy
    }

    pub(crate) fn set_busy(&mut self, is_busy: bool) {
        self.is_busy = is_busy && !self.follows_unseen;
    }

    /// A frame is being drawn: it counts for the title and for what the machine does, unless there was a
    /// pause before it. Gives the time since the last one, if there was one.
    pub(crate) fn count_frame(&mut self) -> Option<Duration> {
        let now = self.now();
        let since = now.saturating_sub(self.drawn_at.replace(now)?);
        if self.is_busy {
            self.title.count_frame(since);
            self.hud.frames.push(since);
        }
        self.follows_unseen = false;
        Some(since)
    }

    /// A frame is due that nobody sees, whether it is drawn or waits for the one before it: neither it nor
    /// the time until the next one that is seen counts. Gives the time since the last one, if there was one.
    pub(crate) fn count_unseen_frame(&mut self) -> Option<Duration> {
        let now = self.now();
        self.follows_unseen = true;
        Some(now.saturating_sub(self.drawn_at.replace(now)?))
    }

    /// What a picture lies on.
    pub fn ground(&self) -> Ground {
        self.panel.ground.beside(self.window.is_dark)
    }
}
