//! The rooms of vastex-browser, in the order in which data flows; each with those that it imports from.

use super::Room;

pub(super) const ROOMS: &[Room] =
    &[("source", &[]), ("show", &["source"]), ("page", &["show"]), ("lib", &["show"])];
