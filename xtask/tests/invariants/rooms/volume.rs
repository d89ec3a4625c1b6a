//! The rooms of vastex-volume, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("fault", &[]),
    ("spare", &[]),
    ("units", &[]),
    ("values", &[]),
    ("keys", &["fault", "spare"]),
    ("json", &["fault", "keys"]),
    ("codecs", &["fault", "spare"]),
    ("chunks", &["fault"]),
    ("stored", &["chunks"]),
    ("volume", &["chunks", "fault", "spare", "stored", "units", "values"]),
    ("reduce", &["values"]),
    ("made", &["chunks", "fault", "reduce", "stored", "volume"]),
    ("source", &["chunks", "fault", "made", "reduce", "stored", "values", "volume"]),
    ("zarr", &["chunks", "codecs", "fault", "json", "keys", "values"]),
    ("ome", &["chunks", "fault", "json", "keys", "units", "values", "volume", "zarr"]),
    ("flat", &["chunks", "fault", "values", "volume"]),
    ("stack", &["chunks", "fault", "flat", "units", "values", "volume"]),
    ("tiled", &["chunks", "fault", "json", "reduce", "values", "volume"]),
    ("open", &["chunks", "fault", "flat", "keys", "ome", "stack", "tiled", "volume", "zarr"]),
    ("lib", &["codecs", "fault", "made", "open", "reduce", "source", "tiled", "values", "volume"]),
];
