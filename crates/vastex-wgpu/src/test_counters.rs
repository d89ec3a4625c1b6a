//! What tests count of a device's work, and the step of it that they make fail; for each thread.

use std::cell::Cell;

thread_local! {
    static COMPUTE_PIPELINES: Cell<u32> = const { Cell::new(0) };
    static POLLS: Cell<u32> = const { Cell::new(0) };
    static STEPS_TO_FAILURE: Cell<Option<u32>> = const { Cell::new(None) };
}

/// Compute pipelines that this thread has made so far through this crate.
pub fn compute_pipelines() -> u32 {
    COMPUTE_PIPELINES.get()
}

pub(crate) fn count_compute_pipelines(made: u32) {
    COMPUTE_PIPELINES.set(COMPUTE_PIPELINES.get() + made);
}

/// Times that this thread has polled a device so far through this crate.
pub fn polls() -> u32 {
    POLLS.get()
}

pub(crate) fn count_poll() {
    POLLS.set(POLLS.get() + 1);
}

/// Makes one step on this thread fail, after `steps` others; `None` clears that. A step is a check for a lost
/// device, or an allocation on it. Returns true if an earlier failure was still to come.
pub fn fail_after(steps: Option<u32>) -> bool {
    STEPS_TO_FAILURE.replace(steps).is_some()
}

/// Returns true if this step is the one to fail.
pub(crate) fn is_to_fail() -> bool {
    let left = STEPS_TO_FAILURE.get();
    STEPS_TO_FAILURE.set(left.and_then(|left| left.checked_sub(1)));
    left == Some(0)
}
