//! The rooms of vastex, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("error", &[]),
    ("settings", &[]),
    ("sampled", &[]),
    ("sources", &["error", "settings"]),
    ("paging", &["error", "settings"]),
    ("gpu", &["error", "sampled", "settings"]),
    ("cpu", &["error", "paging", "sampled", "settings"]),
    ("watch", &["error"]),
    ("textures", &["cpu", "error", "gpu", "paging", "sampled", "settings", "sources", "watch"]),
    ("lib", &["cpu", "error", "gpu", "paging", "sampled", "settings", "sources", "textures", "watch"]),
];
