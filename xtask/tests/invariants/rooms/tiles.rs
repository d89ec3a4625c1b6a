//! The rooms of vastex-tiles, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("exchange", &[]),
    ("ground", &[]),
    ("tile", &["ground"]),
    ("stores", &["ground"]),
    ("sources", &["ground", "stores", "tile"]),
    ("container/format", &["ground", "stores", "tile"]),
    ("container/read", &["container/format", "ground", "sources", "stores", "tile"]),
    ("container/write", &["container/format", "container/read", "ground", "sources", "stores", "tile"]),
    ("container", &["container/format", "container/read", "container/write"]),
    ("caches/disk", &["container/format", "ground", "sources", "stores", "tile"]),
    ("caches", &["caches/disk", "ground", "sources", "tile"]),
    ("loader", &["ground", "sources", "stores", "tile"]),
    ("testing", &["ground", "sources", "tile"]),
    (
        "lib",
        &[
            "caches",
            "caches/disk",
            "container/format",
            "container/read",
            "container/write",
            "exchange",
            "ground",
            "loader",
            "sources",
            "stores",
            "testing",
            "tile",
        ],
    ),
];
