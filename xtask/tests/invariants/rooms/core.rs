//! The rooms of vastex-core, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("lib", &["texture", "table", "wanted", "residency", "pager", "pager/inspect", "record", "lab"]),
    ("shader_constants", &[]),
    ("texture", &["shader_constants"]),
    ("table", &["shader_constants", "texture"]),
    ("wanted", &["shader_constants", "texture"]),
    ("residency", &["shader_constants", "texture", "table"]),
    ("pager/working_set", &["shader_constants", "texture", "wanted", "residency"]),
    (
        "pager",
        &[
            "shader_constants",
            "texture",
            "table",
            "wanted",
            "residency",
            "pager/working_set",
            "pager/inspect",
        ],
    ),
    ("pager/inspect", &["shader_constants", "texture", "table", "wanted", "residency", "pager"]),
    ("record", &["shader_constants", "texture", "wanted"]),
    ("lab", &["shader_constants", "texture", "residency", "record"]),
    ("sim", &["shader_constants", "texture", "table", "wanted", "residency", "pager", "record"]),
];
