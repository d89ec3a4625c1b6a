//! Time, for what waits on others: the loader's time-out and what a frame may cost.

use std::time::Duration;

#[cfg(not(target_family = "wasm"))]
use std::time::Instant;
#[cfg(target_family = "wasm")]
use web_time::Instant;

use crate::ground::sync::{MaybeSend, MaybeSync};

/// Tells how much time has passed. A loader asks it instead of the system, so that tests can say what time it is.
pub trait Clock: MaybeSend + MaybeSync {
    /// Time since some fixed moment; never less than before.
    fn now(&self) -> Duration;
}

/// The system's monotonic clock; in a browser `performance.now()`.
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
