//! The rooms of vastex-build, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("image", &["threads"]),
    ("threads", &[]),
    ("progress", &["image"]),
    ("new_directory", &[]),
    ("texels", &["image"]),
    ("tile", &["image", "texels"]),
    // A pyramid's rows of pages hand their texels to the encoder: that saves a copy of each tile.
    ("pyramid", &["texels", "threads", "tile"]),
    ("replace/error", &["image", "threads"]),
    ("replace", &["image", "progress", "replace/error", "texels", "threads", "tile"]),
    // What a caller is told of an inset is what a replacement says; the rest of a build knows nothing of
    // replacing.
    ("build/error", &["image", "replace/error", "texels", "threads"]),
    ("build", &["build/error", "image", "progress", "pyramid", "texels", "threads", "tile"]),
    ("inset", &["build", "build/error", "image", "progress", "replace", "replace/error", "threads", "tile"]),
    ("export", &["image", "new_directory", "progress", "texels", "threads", "tile"]),
    ("cache", &["build", "build/error", "image", "progress"]),
    ("block_source", &["texels", "tile"]),
    ("source", &["image", "texels"]),
    ("keep_levels", &["build", "build/error", "image", "progress", "source", "texels", "threads", "tile"]),
    ("memory_image", &["build/error", "image", "progress", "texels", "threads"]),
    ("crop", &["image", "progress", "source", "threads", "tile"]),
    ("volume", &["new_directory", "progress", "threads"]),
    (
        "lib",
        &[
            "block_source",
            "build",
            "build/error",
            "cache",
            "crop",
            "export",
            "image",
            "inset",
            "keep_levels",
            "memory_image",
            "progress",
            "replace",
            "replace/error",
            "source",
            "texels",
            "threads",
            "tile",
            "volume",
        ],
    ),
    ("measure", &["build", "build/error", "texels"]),
];
