//! The rooms of the program `vastex`, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("report", &[]),
    ("args", &["report"]),
    ("link", &["args"]),
    ("output", &[]),
    ("progress", &[]),
    ("gpu", &["report"]),
    ("shortage", &["report"]),
    ("explained", &[]),
    ("telemetry", &["output"]),
    ("parts", &[]),
    ("pictures", &["args", "output"]),
    ("planet", &[]),
    // Beside whatever is drawn of volumes.
    ("made_levels", &["report"]),
    ("disk_cache", &["args", "report"]),
    ("open", &["args", "disk_cache", "planet", "progress", "report"]),
    ("places", &["open", "pictures"]),
    (
        "commands",
        &[
            "args",
            "disk_cache",
            "explained",
            "gpu",
            "made_levels",
            "open",
            "output",
            "parts",
            "pictures",
            "places",
            "progress",
            "report",
            "shortage",
            "telemetry",
        ],
    ),
    ("volumes", &["args", "commands", "disk_cache", "open"]),
    (
        "screenshot",
        &["args", "commands", "made_levels", "open", "output", "parts", "places", "report", "volumes"],
    ),
    // The window shows what `vastex info` says, and writes the pictures that `render` and `screenshot` do.
    (
        "view",
        &[
            "args",
            "commands",
            "explained",
            "gpu",
            "link",
            "made_levels",
            "open",
            "output",
            "report",
            "screenshot",
            "shortage",
            "volumes",
        ],
    ),
    ("main", &["args", "commands", "open", "report", "view"]),
];
