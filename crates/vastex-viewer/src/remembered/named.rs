//! What is remembered by its name: how texels are blended, and how views say what they want.

use serde::Serializer;
use serde_json::Value;
use vastex::{FeedbackMode, Filter};

/// The mode that has a name.
pub(super) fn mode(name: &str) -> Option<FeedbackMode> {
    FeedbackMode::ALL.into_iter().find(|mode| mode.name() == name)
}

/// Takes what a name stands for into its place, nothing for no name. Returns true if it stands for anything.
pub(super) fn taken<T>(value: &Value, place: &mut Option<T>, read: impl Fn(&str) -> Option<T>) -> bool {
    if value.is_null() {
        return true;
    }
    let read = value.as_str().and_then(read);
    let is_taken = read.is_some();
    if is_taken {
        *place = read;
    }
    is_taken
}

/// Writes the name of a filter.
pub(super) fn filter<S: Serializer>(filter: &Option<Filter>, serializer: S) -> Result<S::Ok, S::Error> {
    match filter {
        Some(filter) => serializer.collect_str(filter),
        None => serializer.serialize_none(),
    }
}

/// Writes the name of a mode of feedback.
pub(super) fn feedback<S: Serializer>(mode: &Option<FeedbackMode>, serializer: S) -> Result<S::Ok, S::Error> {
    match mode {
        Some(mode) => serializer.serialize_str(mode.name()),
        None => serializer.serialize_none(),
    }
}
