//! What keys and gestures do, in words for a person.

/// Parts of the list, each with its keys or gestures and what they do.
pub const CONTROLS: &[(&str, &[(&str, &str)])] = &[
    (
        "Move",
        &[
            ("drag, one finger", "pan; let go while moving and it glides"),
            ("wheel, two fingers", "zoom to the pointer"),
            ("W A S D, arrows", "pan, or walk over a plane or terrain"),
            ("+ -, I O", "zoom in, zoom out"),
            ("1 to 9", "so many pixels a texel, texels exactly on pixels"),
            ("Ctrl + 1 to 9", "so many texels a pixel"),
            ("0, R, Home, double click", "all of it, as at first"),
        ],
    ),
    (
        "Files",
        &[("N, Page Down", "next file"), ("P, Page Up", "file before"), ("drop", "open what is dropped")],
    ),
    (
        "Show",
        &[
            ("F1 F2 F3 F4, Tab", "as an image, on a plane, a globe, a terrain; the next of them"),
            ("M", "panel: files, and how values become colours"),
            ("C", "contrast: black and white by the values in view"),
            ("L", "overlays of the page table and the pools"),
            ("right click", "why a pixel shows what it shows"),
            ("F, F11", "whole screen"),
            ("?, H", "this list"),
            ("Q, Escape", "end"),
        ],
    ),
];
