//! The rooms of vastex-build, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] = &[];
