//! What the window was like when it was closed, remembered from one run to the next.

use std::path::PathBuf;

use egui::ThemePreference;
use serde::{Deserialize, Serialize};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::state;

/// Pixels of a side of a window that may be remembered.
const SIDE: std::ops::RangeInclusive<u32> = 64..=16_384;
/// How far from the first screen's corner a window may have been, in pixels.
const FAR: i32 = 65_536;

/// A window, and what was shown in it.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(default)]
pub(super) struct Remembered {
    /// Width and height in pixels.
    pub(super) size: Option<[u32; 2]>,
    /// Where it was, where the window system says so.
    pub(super) position: Option<[i32; 2]>,
    pub(super) is_maximized: bool,
    pub(super) panel_is_open: bool,
    pub(super) hud_is_shown: bool,
    pub(super) guides_are_hidden: bool,
    pub(super) values_are_hidden: bool,
    pub(super) theme: Theme,
}

/// Light, dark, or as the system is.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Theme {
    #[default]
    System,
    Dark,
    Light,
}

impl From<Theme> for ThemePreference {
    fn from(theme: Theme) -> ThemePreference {
        match theme {
            Theme::System => ThemePreference::System,
            Theme::Dark => ThemePreference::Dark,
            Theme::Light => ThemePreference::Light,
        }
    }
}

impl From<ThemePreference> for Theme {
    fn from(preference: ThemePreference) -> Theme {
        match preference {
            ThemePreference::System => Theme::System,
            ThemePreference::Dark => Theme::Dark,
            ThemePreference::Light => Theme::Light,
        }
    }
}

impl Remembered {
    /// The window of the run before, or one that nobody has changed.
    pub(super) fn load() -> Remembered {
        place().map(|place| state::load::<Remembered>(&place)).unwrap_or_default().checked()
    }

    /// A window as it is, and of so many pixels. One that fills the screen goes back to the size that it had.
    pub(super) fn of(window: &Window, size: [u32; 2]) -> Remembered {
        let (before, is_maximized) = (Remembered::load(), window.is_maximized());
        if window.fullscreen().is_some() || is_maximized {
            return Remembered { is_maximized, ..before };
        }
        let position = window.outer_position().ok().map(|place| [place.x, place.y]);
        Remembered { size: Some(size), position, is_maximized, ..before }
    }

    /// Where it was, if a window there would be seen: screens come and go.
    pub(super) fn position_on_a_screen(&self, events: &ActiveEventLoop) -> Option<[i32; 2]> {
        let [x, y] = self.position?;
        let is_within = |at: i32, from: i32, length: u32| {
            let at = i64::from(at) - i64::from(from);
            // Enough of it to take hold of.
            (-8..i64::from(length) - 64).contains(&at)
        };
        let is_seen = events.available_monitors().any(|screen| {
            let (place, size) = (screen.position(), screen.size());
            is_within(x, place.x, size.width) && is_within(y, place.y, size.height)
        });
        is_seen.then_some([x, y])
    }

    /// Writes it down. Where that cannot be, the next window is the one before it: no reason to trouble the
    /// person.
    pub(super) fn keep(&self) {
        if let Some(place) = place() {
            drop(state::write(&place, self));
        }
    }

    /// Without what no window can have: others may write into the file.
    fn checked(mut self) -> Remembered {
        self.size = self.size.filter(|size| size.iter().all(|side| SIDE.contains(side)));
        self.position =
            self.position.filter(|position| position.iter().all(|side| (-FAR..=FAR).contains(side)));
        self
    }
}

fn place() -> Option<PathBuf> {
    state::place_of("window.json")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_the_one_before_unless_that_is_none() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("of/window.json");
        let window = Remembered {
            size: Some([900, 700]),
            position: Some([-20, 35]),
            panel_is_open: true,
            theme: Theme::Light,
            ..Remembered::default()
        };
        state::write(&place, &window).unwrap();
        assert_eq!(state::load::<Remembered>(&place).checked(), window);
        for (text, size) in [
            (r#"{"size":[900,700],"a later version's":1}"#, Some([900, 700])),
            (r#"{"size":[0,700]}"#, None),
            (r#"{"size":[900,99999],"position":[1,99999999]}"#, None),
            (r#"{"theme":"purple"}"#, None),
            ("nonsense", None),
        ] {
            std::fs::write(&place, text).unwrap();
            let expected = Remembered { size, ..Remembered::default() };
            assert_eq!(state::load::<Remembered>(&place).checked(), expected, "{text}");
        }
    }
}
