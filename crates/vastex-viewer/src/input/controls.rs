//! What keys and gestures do, in words for a person.

/// A part of the list: its name, and its keys or gestures, each with what they do.
type Part = (&'static str, &'static [(&'static str, &'static str)]);

/// Parts of the list, each with its keys or gestures and what they do.
pub const CONTROLS: &[Part] = &[
    (
        "Move",
        &[
            (
                "drag, a finger",
                "move what is below the pointer, a mountain too, which stays there; let go in motion, it goes on",
            ),
            (
                "Ctrl + drag, Ctrl + arrows",
                "turn and tilt the camera round the middle of the view; an image is not tilted: there the arrows go to its edges",
            ),
            ("Z", "look straight down on a globe, north upwards; look north on plane and terrain"),
            ("wheel", "zoom to what is below the pointer, which stays there"),
            (
                "two fingers",
                "move and zoom, by what is below them; on a touchpad by what is below the pointer; lifted in motion, it goes on",
            ),
            (
                "W A S D, arrows",
                "walk; with Shift four times as fast, and arrows over an image a whole view on",
            ),
            (
                "Ctrl + two fingers",
                "zoom to the pointer: on a touchpad as the wheel does, and as far as they move up or down",
            ),
            ("+ and -, I and O", "zoom in, zoom out"),
            ("1 to 9", "each texel of an image as wide as 1 to 9 pixels"),
            ("Ctrl + 1 to 9", "1 to 9 texels of an image in each pixel"),
            ("T, Shift + T", "turn an image by a quarter, clockwise or back"),
            ("X, Y", "exchange left and right of an image, or top and bottom"),
            ("0, R, Home", "all of it, as at first"),
            (
                "double click",
                "all of an image, as at first; elsewhere twice as near to what is below the pointer",
            ),
        ],
    ),
    FILES,
    (
        "Show",
        &[
            ("Page Down, Page Up", "next and previous file"),
            ("F1 to F4, F10, E", "image, plane, globe, terrain, planet; the next of them"),
            ("C", "black and white by the values in view, once all of an image is there"),
            ("[ and ]", "darker and lighter, by half a stop of exposure"),
            ("K", "measure an image: a click sets a point, a double click closes the line"),
            ("Backspace", "take the point back that was set last in measuring"),
            (
                "V",
                "compare the uppermost layer with those beneath it: swipe, flicker, difference, side by side; then not",
            ),
            (
                "drag the line",
                "how much of an image that is compared by swipe is seen of the uppermost layer",
            ),
            ("click or drag on the map", "go to that place of the image"),
            ("drag the ends of the histogram", "the values that are black and white"),
            ("B", "files that lie over one another side by side, with one camera, or over one another again"),
            (
                "L",
                "next overlay: levels, wanted, deficit, pages, feedback, table, atlas; then the picture again",
            ),
            ("right click", "why a pixel shows what it shows: in the window, and in full on stdout"),
        ],
    ),
    WINDOW,
];

/// What keys do to the files of a window, whatever is shown.
pub(crate) const FILES: Part = (
    "Files",
    &[
        ("Ctrl + O", "open a file that is chosen in a dialog"),
        ("N, Alt + right", "next file, of those named or dropped, else of the folder"),
        ("P, Alt + left", "previous file"),
        (
            DROPS,
            "open the first of them; N and P step through them; a text file may hold a link; a camera path, `.path`, is played",
        ),
        ("Ctrl + N", "another window, which offers to open a file"),
        ("Ctrl + D", "another window with what is shown here"),
    ],
);

/// A gesture that not every window system has.
pub(crate) const DROPS: &str = "dropped files";

/// What is said of it where there is none.
#[cfg(any(test, feature = "egui"))]
pub(crate) const WITHOUT_DROPS: &str = "do not reach a window under Wayland: press Ctrl + O, or copy the file or its path and press Ctrl + V; begun with an empty WAYLAND_DISPLAY, the window is one under X11, which they reach";

/// What keys do to a window, whatever is shown.
pub(crate) const WINDOW: Part = (
    "Window",
    &[
        ("M", "panel: files, bookmarks, what is shown and how, where the camera is, measuring"),
        ("Tab", "into the panel, and on to its next control; Escape leaves it"),
        ("U", "what the machine does: pools, loads, frames, and what can be changed of them"),
        (
            "G",
            "guides: over an image a map, a scale, lines between large texels with their values; over a volume crosshair, box, scale and axes",
        ),
        ("J", "the value below the pointer at the foot of the picture, with its level"),
        (
            "F5, Ctrl + S, F6, F7",
            "a picture of the window into a file, once everything is there: as large, or two or four times as large",
        ),
        (
            "F8, F9",
            "record where the camera goes, and of a volume slices and time, into a file, and end that; play it, or the path of a file",
        ),
        ("Ctrl + C", "copy what is shown as a text, which --view takes"),
        ("Ctrl + Shift + C", "copy it with its files, as a link, which `vastex view` opens"),
        ("Ctrl + V", "show the view, or open the link or the file, that was copied"),
        ("Alt + Enter", "what the file says of itself, in the panel"),
        ("F, F11", "full screen"),
        ("?, H", "keys and gestures"),
        ("Q, Ctrl + Q, Escape", "close this list, end measuring, leave the full screen, or quit"),
    ],
);

/// Keys by the names that lists have for them, where those are expanded: `F1 to F4` are four, and arrows too.
#[cfg(test)]
pub(crate) mod named {
    use super::Part;
    use crate::input::{Key, Modifiers};

    /// Arrows by their names.
    const ARROWS: [&str; 4] = ["left", "right", "up", "down"];

    /// Every key that shortcuts may have, with the name that a list has for it.
    pub(crate) fn keys() -> Vec<(Key, String)> {
        let signs = ['+', '-', '?', '[', ']'].map(|sign| (Key::Char(sign), sign.to_string()));
        let letters = ('a'..='z').map(|letter| (Key::Char(letter), letter.to_uppercase().to_string()));
        let digits = ('0'..='9').map(|digit| (Key::Char(digit), digit.to_string()));
        let functions = (1..=11).map(|n| (Key::F(n), format!("F{n}")));
        let others = [
            (Key::Char(' '), "Space"),
            (Key::Char(','), "comma"),
            (Key::Char('.'), "full stop"),
            (Key::Escape, "Escape"),
            (Key::Enter, "Enter"),
            (Key::Home, "Home"),
            (Key::Tab, "Tab"),
            (Key::Backspace, "Backspace"),
            (Key::PageDown, "Page Down"),
            (Key::PageUp, "Page Up"),
        ];
        let arrows = [Key::Left, Key::Right, Key::Up, Key::Down].into_iter().zip(ARROWS);
        let others = others.into_iter().chain(arrows).map(|(key, name)| (key, name.to_owned()));
        letters.chain(digits).chain(functions).chain(others).chain(signs).collect()
    }

    /// The keys that are held with others, with what stands before the others' names.
    pub(crate) const HELD: [(Modifiers, &str); 4] = [
        (Modifiers { shift: false, control: false, alt: false }, ""),
        (Modifiers { shift: true, control: false, alt: false }, "Shift + "),
        (Modifiers { shift: false, control: true, alt: false }, "Ctrl + "),
        (Modifiers { shift: false, control: false, alt: true }, "Alt + "),
    ];

    /// The names of all keys that are listed, each by itself, with gestures among them.
    pub(crate) fn listed(parts: &[Part]) -> Vec<String> {
        let rows = parts.iter().flat_map(|(_, rows)| *rows);
        let names = rows.flat_map(|(keys, _)| keys.split(", ")).flat_map(|keys| keys.split(" and "));
        names.flat_map(expanded).collect()
    }

    fn expanded(name: &str) -> Vec<String> {
        let (held, key) =
            name.rsplit_once(" + ").map_or((String::new(), name), |(held, key)| (format!("{held} + "), key));
        let keys: Vec<String> = match (key, key.split_once(" to ")) {
            ("W A S D", _) => "WASD".chars().map(String::from).collect(),
            ("arrows", _) => ARROWS.map(str::to_owned).into(),
            ("arrows up", _) => vec!["up".to_owned()],
            (_, Some((first, last))) => {
                let letter: String = first.chars().take_while(|c| !c.is_ascii_digit()).collect();
                let number = |text: &str| text.trim_start_matches(&*letter).parse::<u32>().unwrap();
                (number(first)..=number(last)).map(|n| format!("{letter}{n}")).collect()
            }
            (key, None) => vec![key.to_owned()],
        };
        keys.into_iter().map(|key| format!("{held}{key}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::named::{HELD, keys, listed};
    use super::*;
    use crate::input::{Input, InputEvent, Key};

    /// Keys that do with others what they do alone, or nothing that anybody looks for.
    fn does_as_alone(held: &str, key: Key) -> bool {
        match held {
            "Shift + " => true,
            "Alt + " => matches!(key, Key::F(_)),
            "Ctrl + " => !matches!(key, Key::Char(_)),
            _ => false,
        }
    }

    #[test]
    fn every_key_that_does_something_is_listed_and_no_other() {
        let listed = listed(CONTROLS);
        for (modifiers, held) in HELD {
            for (key, name) in keys() {
                let name = format!("{held}{name}");
                let mut input = Input::default();
                input.on_event(InputEvent::Modifiers(modifiers), [640, 480], Duration::ZERO);
                let press = InputEvent::Key { key, is_pressed: true, is_repeat: false };
                let acts = input.on_event(press, [640, 480], Duration::ZERO).is_some();
                let is_listed = listed.contains(&name);
                assert!(acts || !is_listed, "{name} is listed and does nothing");
                assert!(is_listed || !acts || does_as_alone(held, key), "{name} is not listed");
            }
        }
        assert!(listed.iter().any(|gesture| gesture == "Ctrl + two fingers"));
    }
}
