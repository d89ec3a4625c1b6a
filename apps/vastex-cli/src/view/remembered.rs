//! What the window was like when it was closed, in the system's place for state.

use std::io;
use std::path::{Path, PathBuf};

use serde_json::Value;
use vastex_viewer::Remembered;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::state;
use crate::report;

/// The window of the run before, or one that nobody has changed; and what of it is left out, since no window
/// can have it.
pub(super) fn load() -> (Remembered, Vec<String>) {
    place().map(|place| read(&place)).unwrap_or_default()
}

fn read(place: &Path) -> (Remembered, Vec<String>) {
    let (window, notes) = match state::read::<Value>(place) {
        Ok(written) => Remembered::from_json(written),
        Err(error) => (Remembered::default(), vec![format!("cannot be read ({error}), and is left out")]),
    };
    // What cannot be used stays there.
    let remedy = |note: String| format!("{}: {note}; mend the file, or move it away", place.display());
    (window, notes.into_iter().map(remedy).collect())
}

/// Writes it down, and leaves what else the file has. Where that cannot be, the next window is the one before
/// it, and a line on stderr says why.
pub(super) fn keep(window: &Remembered) {
    let Some(place) = place() else { return };
    if let Err(error) = keep_in(&place, window) {
        report::say(&format!("note: {}: the window is not remembered: {error}", place.display()));
    }
}

fn keep_in(place: &Path, window: &Remembered) -> io::Result<()> {
    state::change_fields(place, |written| Remembered::from_json(written).0, window)
}

fn place() -> Option<PathBuf> {
    state::place_of("window.json")
}

/// A window as it is, and of so many pixels. One that fills the screen goes back to the size that it had.
pub(super) fn of_window(window: &Window, size: [u32; 2]) -> Remembered {
    let ((before, _), is_maximized) = (load(), window.is_maximized());
    if window.fullscreen().is_some() || is_maximized {
        return Remembered { is_maximized, ..before };
    }
    let position = window.outer_position().ok().map(|place| [place.x, place.y]);
    Remembered { size: Some(size), position, is_maximized, ..before }
}

/// Where a window was, if one there would be seen: screens come and go.
pub(super) fn position_on_a_screen(before: &Remembered, events: &ActiveEventLoop) -> Option<[i32; 2]> {
    let [x, y] = before.position?;
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

#[cfg(test)]
mod tests {
    use vastex_viewer::{KeptPool, KeptRule, Theme};

    use super::*;

    #[test]
    fn a_window_is_the_one_before_and_what_cannot_be_read_is_named() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("of/window.json");
        assert_eq!(read(&place), (Remembered::default(), Vec::new()), "the first time");
        let window = Remembered { size: Some([900, 700]), hud_is_shown: true, ..Remembered::default() };
        state::write(&place, &window).unwrap();
        assert_eq!(read(&place), (window, Vec::new()));
        for text in ["nonsense", "{\"size\": ", "[1]", "\u{0}", "{\"size\": 7}"] {
            std::fs::write(&place, text).unwrap();
            let (window, notes) = read(&place);
            assert_eq!((window, notes.len()), (Remembered::default(), 1), "{text}: {notes:?}");
            assert!(notes[0].contains("window.json: "), "{notes:?}");
        }
    }

    /// What a person mistyped, and what a later version wrote, is there the next time.
    #[test]
    fn what_no_window_can_have_stays_in_the_file() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("window.json");
        let text = r#"{"filter": "lanczos", "later": {"a": 1}, "theme": "dark", "hud_is_shown": true,
            "pools": {"136x136 r8": {"bytes": 0}, "136x136 r16": {"bytes": 4096, "later": 1}}}"#;
        std::fs::write(&place, text).unwrap();
        let (mut window, _) = read(&place);
        (window.theme, window.size) = (Theme::Light, Some([900, 700]));
        window.pools.insert("136x136 bc1-srgb".into(), KeptPool { bytes: None, rule: Some(KeptRule::Never) });
        keep_in(&place, &window).unwrap();
        let kept: Value = state::read(&place).unwrap();
        let pools = serde_json::json!({
            "136x136 r8": {"bytes": 0}, "136x136 r16": {"bytes": 4096, "later": 1},
            "136x136 bc1-srgb": {"rule": "never"}
        });
        assert_eq!((&kept["filter"], &kept["later"]["a"]), (&"lanczos".into(), &1.into()));
        assert_eq!(
            (&kept["theme"], &kept["size"][0], &kept["pools"]),
            (&"light".into(), &900.into(), &pools)
        );
        assert_eq!(read(&place).0, window);
        // What cannot be read at all is the person's to mend.
        let broken = text.replace("true,", "true,,");
        std::fs::write(&place, &broken).unwrap();
        let (window, notes) = read(&place);
        assert!(notes.len() == 1 && notes[0].contains("mend the file"), "{notes:?}");
        keep_in(&place, &window).unwrap_err();
        assert_eq!(std::fs::read_to_string(&place).unwrap(), broken);
    }
}
