//! The rooms of apps/scenes, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("wait", &[]),
    ("attribute", &[]),
    ("clock", &[]),
    ("levels", &[]),
    ("compare", &[]),
    ("reference", &["levels"]),
    ("error", &["reference"]),
    ("places", &["wait"]),
    ("cpu_picture", &["error", "places"]),
    ("estimate", &[]),
    ("offscreen", &["clock", "compare", "cpu_picture", "error", "estimate", "places", "reference", "wait"]),
    ("shaders", &["attribute"]),
    ("planet", &["attribute", "compare", "levels", "reference", "shaders", "wait"]),
    ("planet_image", &[]),
    ("descent", &["planet", "shaders", "wait"]),
    ("traced", &[]),
    (
        "lib",
        &[
            "attribute",
            "clock",
            "compare",
            "descent",
            "error",
            "estimate",
            "levels",
            "offscreen",
            "planet",
            "planet_image",
            "reference",
            "traced",
            "wait",
        ],
    ),
];
