//! What a pager tells people and tools of itself, and the walk over all of its structures for tests.

#[cfg(feature = "checks")]
pub mod checks;
pub(crate) mod explain;
#[cfg(feature = "checks")]
pub(crate) mod savings;
pub(crate) mod telemetry;
pub(crate) mod usage;

#[cfg(not(feature = "checks"))]
impl crate::pager::pool::Pager {
    /// Without the feature `checks` nothing is checked.
    pub(crate) fn check(&self) {}
}
