//! The rooms of vastex-viewer, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("gpu", &[]),
    ("words", &[]),
    ("figures", &[]),
    ("scene", &[]),
    ("picture", &[]),
    ("camera", &["picture", "scene"]),
    ("layers", &[]),
    ("input", &["camera", "picture", "scene"]),
    ("stage", &["gpu"]),
    ("surface", &["camera", "gpu", "layers", "picture", "scene", "stage", "words"]),
    ("volume", &["gpu", "layers", "stage"]),
    ("volume_scene", &["gpu", "input", "layers", "stage", "volume"]),
    ("overlay", &["camera", "gpu", "layers", "stage", "surface"]),
    ("inspect", &["camera", "gpu", "layers", "stage", "surface"]),
    ("view_text", &["camera", "layers", "overlay", "scene", "surface", "volume", "volume_scene", "words"]),
    ("link", &["view_text"]),
    (
        "panels",
        &[
            "camera",
            "figures",
            "input",
            "inspect",
            "layers",
            "surface",
            "view_text",
            "volume",
            "volume_scene",
        ],
    ),
    ("hud", &["figures", "overlay", "stage"]),
    ("widget", &["camera", "gpu", "input", "inspect", "layers", "scene", "stage", "surface"]),
    (
        "lib",
        &["camera", "gpu", "layers", "link", "overlay", "picture", "scene", "stage", "surface", "view_text"],
    ),
];
