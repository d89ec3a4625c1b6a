//! Work of tests that must end: on a thread of its own, and waited for with a limit.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

/// Does some work on a thread of its own, and gives what comes of it; an error that says so if that has not
/// ended after `limit`. The thread then goes on until the program ends, and so do those that it waits for.
///
/// A test whose threads wait for each other does all of its work in here: so one that hangs fails, by its
/// name, where a join would keep the whole program from ending. Panics as the work does.
pub fn ends_within<T: Send + 'static>(
    limit: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, String> {
    let (sender, receiver) = channel();
    // Nobody listens any more where it ends too late.
    let thread = Builder::new().spawn(move || drop(sender.send(work())));
    let thread = thread.map_err(|error| format!("has not begun: {error}"))?;
    match receiver.recv_timeout(limit) {
        Ok(done) => Ok(done),
        Err(RecvTimeoutError::Timeout) => Err(format!("has not ended after {limit:?}")),
        // The sender goes when the thread unwinds, which is its end.
        Err(RecvTimeoutError::Disconnected) => match thread.join() {
            Err(panic) => resume_unwind(panic),
            Ok(()) => Err("ended without a result".into()),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Barrier};

    use super::*;

    #[test]
    fn what_hangs_is_told_and_what_panics_panics() {
        let patience = Duration::from_secs(300);
        assert_eq!(ends_within(patience, || 7), Ok(7));
        let panicked = std::panic::catch_unwind(|| ends_within(patience, || assert_eq!(1, 2, "of a test")));
        let said = panicked.unwrap_err();
        assert!(said.downcast_ref::<String>().is_some_and(|said| said.contains("of a test")));
        // One thread of two that wait for each other.
        let both = Arc::new(Barrier::new(2));
        let one = both.clone();
        let hung = ends_within(Duration::from_millis(1), move || one.wait().is_leader());
        assert_eq!(hung, Err("has not ended after 1ms".into()));
        both.wait();
    }
}
