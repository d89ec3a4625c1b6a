//! What a window was like when it was closed, as what is written down from one run to the next (feature
//! `egui`). Where it is written is the host's.

mod named;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use egui::ThemePreference;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use vastex::diagnostics::Integrator;
use vastex::{BiasRule, FeedbackMode, Filter};

use crate::layers::Ground;

/// Pixels of a side of a window that may be remembered.
const SIDE: RangeInclusive<u32> = 64..=16_384;
/// How far from the first screen's corner a window may have been, in pixels.
const FAR: i32 = 65_536;
/// Bytes of a pool that may be remembered.
const POOL_BYTES: RangeInclusive<u64> = 1 << 10..=1 << 40;

/// Bytes of uploads in a frame, and of loads on their way, that may be remembered.
const BUDGETS: RangeInclusive<u64> = 1 << 10..=1 << 30;

/// A window as it was when it was closed: where it was, what was shown in it, and what a person chose there
/// of how textures are sampled and kept. The default is a window that nobody has changed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Remembered {
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// The place of the window's corner, where the window system says so.
    pub position: Option<[i32; 2]>,
    /// True if it filled a screen, but for the system's own bars.
    pub is_maximized: bool,
    /// True if the panel was open.
    pub panel_is_open: bool,
    /// True if what the machine does was shown.
    pub hud_is_shown: bool,
    /// True if no guides lay over the picture.
    pub guides_are_hidden: bool,
    /// True if no line said what lies below the pointer.
    pub values_are_hidden: bool,
    /// Light or dark panels.
    pub theme: Theme,
    /// What the picture lay on.
    pub ground: ChosenGround,
    /// How texels are blended; `None` for what suits the magnification.
    #[serde(serialize_with = "named::filter", skip_serializing_if = "Option::is_none")]
    pub filter: Option<Filter>,
    /// How views say what they want; `None` for the best that the device has.
    #[serde(serialize_with = "named::feedback", skip_serializing_if = "Option::is_none")]
    pub feedback: Option<FeedbackMode>,
    /// Bytes copied to the GPU in a frame; nothing for what the command line says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub upload_bytes_per_frame: Option<u64>,
    /// Bytes of tiles on their way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_flight_bytes: Option<u64>,
    /// What was chosen of pools, by what they are.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub pools: BTreeMap<String, KeptPool>,
}

/// What was chosen of a pool.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(default)]
pub struct KeptPool {
    /// The bytes of a pool that was sized by hand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    /// How the mip bias of the pool is decided, where that was chosen.
    pub rule: Option<KeptRule>,
}

impl KeptPool {
    /// Returns true if nothing was chosen of the pool.
    pub fn is_empty(&self) -> bool {
        *self == KeptPool::default()
    }
}

/// How the mip bias of a pool is decided.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KeptRule {
    /// By [`BiasRule::Solved`].
    Solved,
    /// By [`BiasRule::Integrating`].
    Integrating,
    /// There is never one.
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

/// What a person chose for the picture to lie on.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ChosenGround {
    /// Dark or light, as the panels are.
    #[default]
    Theme,
    /// [`Ground::Dark`].
    Dark,
    /// [`Ground::Light`].
    Light,
    /// [`Ground::Chequers`].
    Chequers,
}

impl ChosenGround {
    /// Every choice, in the order in which panels offer them.
    pub const ALL: [ChosenGround; 4] =
        [ChosenGround::Theme, ChosenGround::Dark, ChosenGround::Light, ChosenGround::Chequers];

    /// A word or a few for people.
    pub fn name(self) -> &'static str {
        match self {
            ChosenGround::Theme => "as the theme",
            ChosenGround::Dark => Ground::Dark.name(),
            ChosenGround::Light => Ground::Light.name(),
            ChosenGround::Chequers => Ground::Chequers.name(),
        }
    }

    /// The ground beside panels that are dark or light.
    pub fn beside(self, panels_are_dark: bool) -> Ground {
        match self {
            ChosenGround::Theme if panels_are_dark => Ground::Dark,
            ChosenGround::Theme | ChosenGround::Light => Ground::Light,
            ChosenGround::Dark => Ground::Dark,
            ChosenGround::Chequers => Ground::Chequers,
        }
    }
}

/// Light or dark panels, or panels as the system has them.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    #[default]
    /// As the system has them.
    System,
    /// Dark.
    Dark,
    /// Light.
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
    /// The window that was written down as JSON, and a note on each thing in it that is left out, since no
    /// window can have it: others may write into the file, and later versions do. Nothing (`null`) is a
    /// window that nobody has changed.
    pub fn from_json(written: Value) -> (Remembered, Vec<String>) {
        let (mut window, mut notes) = (Remembered::default(), Vec::new());
        let mut leave_out = |what: &str| notes.push(format!("{what}, and is left out"));
        match written {
            Value::Null => {}
            Value::Object(fields) => {
                for (name, value) in fields {
                    window.take(&name, value, &mut leave_out);
                }
            }
            _ => leave_out("has no fields"),
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

    fn read(text: &str) -> (Remembered, Vec<String>) {
        Remembered::from_json(serde_json::from_str(text).unwrap())
    }

    #[test]
    fn a_window_is_the_one_before() {
        let again = |window: &Remembered| Remembered::from_json(serde_json::to_value(window).unwrap());
        assert_eq!(read("null"), (Remembered::default(), Vec::new()), "the first time");
        assert_eq!(again(&window()), (window(), Vec::new()));
        // Whatever is chosen is written by a name that is read again.
        for filter in ["nearest", "bilinear", "trilinear", "anisotropic2", "anisotropic16", "bicubic"] {
            let filter = Some(filter.parse().unwrap());
            for feedback in FeedbackMode::ALL.map(Some) {
                let window = Remembered { filter, feedback, ..Remembered::default() };
                assert_eq!(again(&window), (window, Vec::new()));
            }
        }
        for rule in [None, Some(BiasRule::Solved), Some(BiasRule::Integrating(Integrator::default()))] {
            assert_eq!(Option::<BiasRule>::from(KeptRule::from(rule)), rule);
        }
    }

    /// What no window can have is named, and everything beside it counts.
    #[test]
    fn what_a_window_cannot_have_is_left_out_alone_and_said() {
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
            let (window, notes) = read(&format!("{{{text}, \"hud_is_shown\": true}}"));
            assert_eq!(window, Remembered { hud_is_shown: true, ..Remembered::default() }, "{text}");
            let is_said = |said: &str| notes.iter().any(|note| note.contains(said));
            assert!(said.map_or(notes.is_empty(), is_said), "{text}: {notes:?}");
            assert!(notes.iter().all(|note| note.ends_with(", and is left out")), "{notes:?}");
        }
        for text in ["[1]", "7"] {
            let (window, notes) = read(text);
            assert_eq!((window, notes.len()), (Remembered::default(), 1), "{text}: {notes:?}");
        }
        // One of many that are in order.
        let long = "x".repeat(5000);
        let text = format!(r#"{{"filter":"{long}","pools":{{"a":{{"bytes":4096}},"b":2}}}}"#);
        let (window, notes) = read(&text);
        assert_eq!(window.pools.keys().collect::<Vec<_>>(), ["a"]);
        assert!(notes.len() == 2 && notes.iter().all(|note| note.len() < 400), "{notes:?}");
    }
}
