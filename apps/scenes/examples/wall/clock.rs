//! CPU time of this thread, which a busy machine disturbs less than wall time.

/// Measures one thing after the other.
#[derive(Default)]
pub(crate) struct Clock {
    last: f64,
}

impl Clock {
    /// Seconds since the last call.
    pub(crate) fn lap(&mut self) -> f64 {
        let now = now();
        now - std::mem::replace(&mut self.last, now)
    }
}

#[cfg(target_os = "linux")]
fn now() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(target_os = "linux"))]
fn now() -> f64 {
    static BEGIN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    BEGIN.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}
