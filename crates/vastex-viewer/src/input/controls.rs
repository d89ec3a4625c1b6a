//! What keys and gestures do, in words for a person.

/// Parts of the list, each with its keys or gestures and what they do.
pub const CONTROLS: &[(&str, &[(&str, &str)])] = &[
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
    (
        "Files",
        &[
            ("Ctrl + O", "open a file that is chosen in a dialog"),
            ("N, Page Down, Alt + right", "next file, of those named or dropped, else of the folder"),
            ("P, Page Up, Alt + left", "previous file"),
            (
                "dropped files",
                "open the first of them; N and P step through them; a text file may hold a link; a camera path, `.path`, is played",
            ),
        ],
    ),
    (
        "Show",
        &[
            ("F1 to F4, F10, E", "image, plane, globe, terrain, planet; the next of them"),
            ("M", "panel: files, where the camera is, bookmarks, measuring, layers and their colours"),
            ("Tab", "into the panel, and on to its next control; Escape leaves it"),
            ("U", "what the machine does: pools, loads, frames, and what can be changed of them"),
            ("G", "guides over an image: a map, a scale, lines between large texels with their values"),
            ("J", "the value below the pointer at the foot of the picture, with its level"),
            ("C", "black and white by the values in view, once all of an image is there"),
            ("[ and ]", "darker and lighter, by half a stop of exposure"),
            (
                "K",
                "measure an image: a click sets a point, a double click closes the line, Backspace takes the last one back",
            ),
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
            (
                "F5, Ctrl + S, F6, F7",
                "a picture of the window into a file, once everything is there: as large, or two or four times as large",
            ),
            (
                "F8, F9",
                "record where the camera goes into a file, and end that; play it, or the path of a file",
            ),
            ("Ctrl + C", "copy what is shown as a text, which --view takes"),
            ("Ctrl + Shift + C", "copy it with its files, as a link, which `vastex view` opens"),
            ("Ctrl + V", "show the view, or open the link or the file, that was copied"),
            ("right click", "why a pixel shows what it shows: in the window, and in full on stdout"),
            ("Alt + Enter", "what the file says of itself, in the panel"),
            ("F, F11", "full screen"),
            ("?, H", "keys and gestures"),
            ("Q, Ctrl + Q, Escape", "close this list, end measuring, leave the full screen, or quit"),
        ],
    ),
];
