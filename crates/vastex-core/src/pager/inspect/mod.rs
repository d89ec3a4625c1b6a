//! What a pager tells people and tools of itself, and the walk over all of its structures for tests.

#[cfg(feature = "checks")]
pub mod checks;
pub(crate) mod explain;
pub(crate) mod telemetry;
pub(crate) mod usage;
