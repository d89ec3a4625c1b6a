//! The rooms of vastex-fuzz, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[
    ("rng", &[]),
    ("reseal", &[]),
    ("tree", &[]),
    ("seeds", &["rng", "tree"]),
    ("targets", &["seeds", "tree"]),
    // What a target reads says which damage has a checksum to make right again.
    ("mutate", &["reseal", "rng", "targets", "tree"]),
    ("run", &["mutate", "rng", "targets"]),
    ("lib", &["mutate", "run", "targets", "tree"]),
    ("main", &[]),
];
