//! Time, by which the loader knows that a read is overdue and that a frame's time is up.

use std::time::Duration;

#[cfg(not(target_family = "wasm"))]
use std::time::Instant;
#[cfg(target_family = "wasm")]
use web_time::Instant;

use crate::ground::sync::{MaybeSend, MaybeSync};

/// Tells how much time has passed. A loader asks its clock instead of the system, so that tests can set the
/// time.
pub trait Clock: MaybeSend + MaybeSync {
    /// The time since some fixed moment; never less than at an earlier call.
    fn now(&self) -> Duration;
}

/// The system's monotonic clock; in a browser, `performance.now()`.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock(Instant);

impl SystemClock {
    /// A clock that counts from now on.
    pub fn new() -> SystemClock {
        SystemClock(Instant::now())
    }
}

impl Default for SystemClock {
    fn default() -> SystemClock {
        SystemClock::new()
    }
}

impl Clock for SystemClock {
    fn now(&self) -> Duration {
        self.0.elapsed()
    }
}
