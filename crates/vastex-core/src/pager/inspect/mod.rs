//! What a pager tells people and tools of itself, and the walk over all of its structures for tests.

#[cfg(feature = "checks")]
pub(crate) mod check_pace;
#[cfg(feature = "checks")]
pub mod checks;
pub(crate) mod explain;
pub(crate) mod telemetry;
pub(crate) mod usage;

/// Without the feature `checks` nothing is checked.
#[cfg(not(feature = "checks"))]
mod unchecked {
    impl crate::pager::pool::PoolPager {
        pub(crate) fn check(&self) {}
    }

    impl crate::pager::Pager {
        pub(crate) fn check_in_flight(&self) {}
    }
}
