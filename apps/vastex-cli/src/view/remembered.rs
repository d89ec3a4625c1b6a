//! What the window was like when it was closed, remembered from one run to the next.

mod named;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use egui::ThemePreference;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use vastex::diagnostics::Integrator;
use vastex::{BiasRule, FeedbackMode, Filter};
use vastex_viewer::layers::Ground;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::state;

/// Pixels of a side of a window that may be remembered.
const SIDE: RangeInclusive<u32> = 64..=16_384;
/// How far from the first screen's corner a window may have been, in pixels.
const FAR: i32 = 65_536;
/// Bytes of a pool that may be remembered.
const POOL_BYTES: RangeInclusive<u64> = 1 << 10..=1 << 40;

/// Bytes of uploads in a frame, and of loads on their way, that may be remembered.
const BUDGETS: RangeInclusive<u64> = 1 << 10..=1 << 30;

/// A window, what was shown in it, and what a person chose there of how textures are sampled and kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    pub(super) ground: ChosenGround,
    /// How texels are blended; `None` for what suits the magnification.
    #[serde(serialize_with = "named::filter", skip_serializing_if = "Option::is_none")]
    pub(super) filter: Option<Filter>,
    /// How views say what they want; `None` for the best that the device has.
    #[serde(serialize_with = "named::feedback", skip_serializing_if = "Option::is_none")]
    pub(super) feedback: Option<FeedbackMode>,
    /// Bytes copied to the GPU in a frame; nothing for what the command line says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) upload_bytes_per_frame: Option<u64>,
    /// Bytes of tiles on their way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) in_flight_bytes: Option<u64>,
    /// What was chosen of pools, by what they are.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) pools: BTreeMap<String, KeptPool>,
}

/// What was chosen of a pool.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(default)]
pub(super) struct KeptPool {
    /// Its bytes, where it was sized by hand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) bytes: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rule: Option<KeptRule>,
}

impl KeptPool {
    /// Returns true if nothing is.
    pub(super) fn is_empty(&self) -> bool {
        *self == KeptPool::default()
    }
}

/// How the mip bias of a pool is decided.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum KeptRule {
    Solved,
    Integrating,
    Never,
}

impl From<Option<BiasRule>> for KeptRule {
    fn from(rule: Option<BiasRule>) -> KeptRule {
        match rule {
            None => KeptRule::Never,
            Some(BiasRule::Solved) => KeptRule::Solved,
            Some(BiasRule::Integrating(_)) => KeptRule::Integrating,
        }
    }
}

impl From<KeptRule> for Option<BiasRule> {
    fn from(rule: KeptRule) -> Option<BiasRule> {
        match rule {
            KeptRule::Never => None,
            KeptRule::Solved => Some(BiasRule::Solved),
            KeptRule::Integrating => Some(BiasRule::Integrating(Integrator::default())),
        }
    }
}

/// What the picture lies on.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ChosenGround {
    /// Dark or light, as the panels are.
    #[default]
    Theme,
    Dark,
    Light,
    Chequers,
}

impl ChosenGround {
    pub(super) const ALL: [ChosenGround; 4] =
        [ChosenGround::Theme, ChosenGround::Dark, ChosenGround::Light, ChosenGround::Chequers];

    /// A word for it.
    pub(super) fn name(self) -> &'static str {
        match self {
            ChosenGround::Theme => "as the theme",
            ChosenGround::Dark => Ground::Dark.name(),
            ChosenGround::Light => Ground::Light.name(),
            ChosenGround::Chequers => Ground::Chequers.name(),
        }
    }

    /// The ground beside panels that are dark or light.
    pub(super) fn beside(self, panels_are_dark: bool) -> Ground {
        match self {
            ChosenGround::Theme if panels_are_dark => Ground::Dark,
            ChosenGround::Theme | ChosenGround::Light => Ground::Light,
            ChosenGround::Dark => Ground::Dark,
            ChosenGround::Chequers => Ground::Chequers,
        }
    }
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
    /// The window of the run before, or one that nobody has changed; and what of it is left out, since no
    /// window can have it: others may write into the file, and later versions do.
    pub(super) fn load() -> (Remembered, Vec<String>) {
        place().map(|place| Remembered::read(&place)).unwrap_or_default()
    }

    fn read(place: &Path) -> (Remembered, Vec<String>) {
        let (mut window, mut notes) = (Remembered::default(), Vec::new());
        let mut leave_out = |what: &str| {
            notes.push(format!("{}: {what}, and is left out", place.display()));
        };
        match state::read::<Value>(place) {
            Ok(Value::Null) => {}
            Ok(Value::Object(fields)) => {
                for (name, value) in fields {
                    window.take(&name, value, &mut leave_out);
                }
            }
            Ok(_) => leave_out("has no fields"),
            Err(error) => leave_out(&format!("cannot be read ({error})")),
        }
        (window, notes)
    }

    /// Takes a field of the file, as far as a window can have what it says.
    fn take(&mut self, name: &str, value: Value, leave_out: &mut impl FnMut(&str)) {
        let text = value.to_string();
        let is_budget = |bytes: &Option<u64>| bytes.is_none_or(|bytes| BUDGETS.contains(&bytes));
        let is_taken = match name {
            "size" => {
                taken(value, &mut self.size, |size| size.iter().flatten().all(|side| SIDE.contains(side)))
            }
            "position" => taken(value, &mut self.position, |place| {
                place.iter().flatten().all(|side| (-FAR..=FAR).contains(side))
            }),
            "is_maximized" => taken(value, &mut self.is_maximized, |_| true),
            "panel_is_open" => taken(value, &mut self.panel_is_open, |_| true),
            "hud_is_shown" => taken(value, &mut self.hud_is_shown, |_| true),
            "guides_are_hidden" => taken(value, &mut self.guides_are_hidden, |_| true),
            "values_are_hidden" => taken(value, &mut self.values_are_hidden, |_| true),
            "theme" => taken(value, &mut self.theme, |_| true),
            "ground" => taken(value, &mut self.ground, |_| true),
            "filter" => named::taken(&value, &mut self.filter, |name| name.parse().ok()),
            "feedback" => named::taken(&value, &mut self.feedback, named::mode),
            "upload_bytes_per_frame" => taken(value, &mut self.upload_bytes_per_frame, is_budget),
            "in_flight_bytes" => taken(value, &mut self.in_flight_bytes, is_budget),
            "pools" => {
                let Value::Object(pools) = value else { return leave_out("\"pools\" is no list of pools") };
                for (kind, value) in pools {
                    let (text, mut pool) = (value.to_string(), KeptPool::default());
                    let is_size =
                        |pool: &KeptPool| pool.bytes.is_none_or(|bytes| POOL_BYTES.contains(&bytes));
                    match taken(value, &mut pool, is_size) {
                        true => drop(self.pools.insert(kind, pool)),
                        false => leave_out(&format!("\"pools\" has {} for {kind:?}", short(&text))),
                    }
                }
                true
            }
            // Of a later version.
            _ => true,
        };
        if !is_taken {
            leave_out(&format!("{name:?} is {}", short(&text)));
        }
    }

    /// A window as it is, and of so many pixels. One that fills the screen goes back to the size that it had.
    pub(super) fn of(window: &Window, size: [u32; 2]) -> Remembered {
        let ((before, _), is_maximized) = (Remembered::load(), window.is_maximized());
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
}

/// Takes a value into its place, if it is one that may be there. Returns true if it is.
fn taken<T: DeserializeOwned>(value: Value, place: &mut T, may_be: impl Fn(&T) -> bool) -> bool {
    match serde_json::from_value(value).ok().filter(may_be) {
        Some(read) => {
            *place = read;
            true
        }
        None => false,
    }
}

/// A text, or its beginning: whoever wrote it may have written much.
fn short(text: &str) -> String {
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}..", &text[..end]),
        None => text.to_owned(),
    }
}

fn place() -> Option<PathBuf> {
    state::place_of("window.json")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window() -> Remembered {
        Remembered {
            size: Some([900, 700]),
            position: Some([-20, 35]),
            panel_is_open: true,
            theme: Theme::Light,
            ground: ChosenGround::Chequers,
            filter: Some("anisotropic8".parse().unwrap()),
            feedback: Some(FeedbackMode::Raw),
            upload_bytes_per_frame: Some(3 << 20),
            in_flight_bytes: Some(1 << 24),
            pools: BTreeMap::from([
                ("136x136 r16".to_owned(), KeptPool { bytes: Some(3 << 20), rule: None }),
                ("136x136 bc1-srgb".to_owned(), KeptPool { bytes: None, rule: Some(KeptRule::Never) }),
            ]),
            ..Remembered::default()
        }
    }

    #[test]
    fn a_window_is_the_one_before() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("of/window.json");
        assert_eq!(Remembered::read(&place), (Remembered::default(), Vec::new()), "the first time");
        state::write(&place, &window()).unwrap();
        assert_eq!(Remembered::read(&place), (window(), Vec::new()));
        // Whatever is chosen is written by a name that is read again.
        for filter in ["nearest", "bilinear", "trilinear", "anisotropic2", "anisotropic16", "bicubic"] {
            let filter = Some(filter.parse().unwrap());
            for feedback in FeedbackMode::ALL.map(Some) {
                let window = Remembered { filter, feedback, ..Remembered::default() };
                state::write(&place, &window).unwrap();
                assert_eq!(Remembered::read(&place), (window, Vec::new()));
            }
        }
        for rule in [None, Some(BiasRule::Solved), Some(BiasRule::Integrating(Integrator::default()))] {
            assert_eq!(Option::<BiasRule>::from(KeptRule::from(rule)), rule);
        }
    }

    /// What no window can have is named, and everything beside it counts.
    #[test]
    fn what_a_window_cannot_have_is_left_out_alone_and_said() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("window.json");
        for (text, said) in [
            (r#""a later version's": 1"#, None),
            (r#""size": [0, 700]"#, Some("\"size\" is [0,700]")),
            (r#""size": "large""#, Some("\"size\" is")),
            (r#""position": [1, 99999999]"#, Some("\"position\" is")),
            (r#""theme": "purple""#, Some("\"theme\" is \"purple\"")),
            (r#""ground": "wet""#, Some("\"ground\" is \"wet\"")),
            (r#""filter": "lanczos""#, Some("\"filter\" is \"lanczos\"")),
            (r#""filter": 3"#, Some("\"filter\" is 3")),
            (r#""upload_bytes_per_frame": 0"#, Some("\"upload_bytes_per_frame\" is 0")),
            (r#""in_flight_bytes": 99999999999"#, Some("\"in_flight_bytes\" is 99999999999")),
            (r#""feedback": "psychic""#, Some("\"feedback\" is \"psychic\"")),
            (r#""pools": [1, 2]"#, Some("\"pools\" is no list")),
            (r#""pools": {"136x136 r8": {"bytes": 0}}"#, Some("{\"bytes\":0} for \"136x136 r8\"")),
            (r#""pools": {"136x136 r8": {"bytes": -7}}"#, Some("for \"136x136 r8\"")),
            (r#""pools": {"136x136 r8": {"rule": "sometimes"}}"#, Some("for \"136x136 r8\"")),
            (r#""pools": {"a": 1, "b": {"bytes": 99999999999999999}}"#, Some("for \"a\"")),
        ] {
            std::fs::write(&place, format!("{{{text}, \"hud_is_shown\": true}}")).unwrap();
            let (window, notes) = Remembered::read(&place);
            assert_eq!(window, Remembered { hud_is_shown: true, ..Remembered::default() }, "{text}");
            let is_said = |said: &str| notes.iter().any(|note| note.contains(said));
            assert!(said.map_or(notes.is_empty(), is_said), "{text}: {notes:?}");
            assert!(notes.iter().all(|note| note.contains("window.json")), "{notes:?}");
        }
        for text in ["nonsense", "{\"size\": ", "[1]", "7", "\u{0}"] {
            std::fs::write(&place, text).unwrap();
            let (window, notes) = Remembered::read(&place);
            assert_eq!((window, notes.len()), (Remembered::default(), 1), "{text}: {notes:?}");
        }
        // One of many that are in order.
        let long = "x".repeat(5000);
        std::fs::write(&place, format!(r#"{{"filter":"{long}","pools":{{"a":{{"bytes":4096}},"b":2}}}}"#))
            .unwrap();
        let (window, notes) = Remembered::read(&place);
        assert_eq!(window.pools.keys().collect::<Vec<_>>(), ["a"]);
        assert!(notes.len() == 2 && notes.iter().all(|note| note.len() < 400), "{notes:?}");
    }
}
