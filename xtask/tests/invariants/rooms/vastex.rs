//! The rooms of vastex, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("ids", &[]),
    ("error", &["ids"]),
    ("settings", &[]),
    ("sources", &["error", "settings"]),
    ("paging", &["error", "settings"]),
    ("gpu", &["error", "ids", "settings"]),
    ("cpu", &["error", "ids", "paging", "settings"]),
    ("watch", &["error"]),
    ("textures", &["cpu", "error", "gpu", "ids", "paging", "settings", "sources", "watch"]),
    ("lib", &["cpu", "error", "gpu", "ids", "paging", "settings", "sources", "textures", "watch"]),
];
