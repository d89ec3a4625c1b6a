//! Waiting on a thread of the pool, which goes on doing the pool's work.
//!
//! A thread of the pool that simply waited for a message would be lost to the pool, also for work that the
//! others leave only while it waits: the pieces of a tile that one of them has just begun, say. Nothing in
//! rayon wakes a thread for either of two things, so one that has found no work looks again every
//! millisecond, which takes some microseconds of its time.

use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::Duration;

use rayon::Yield;

/// How long a thread waits before it looks for work again: short beside the encoding of a tile.
const LOOK_AGAIN: Duration = Duration::from_millis(1);

/// What comes next from `messages`, for a thread of a pool, which does the pool's work until then; nothing
/// when no more can come. A message that is there is taken before work is.
pub(super) fn next<T>(messages: &Receiver<T>) -> Option<T> {
    loop {
        match messages.try_recv() {
            Ok(message) => return Some(message),
            Err(TryRecvError::Disconnected) => return None,
            Err(TryRecvError::Empty) if rayon::yield_now() == Some(Yield::Executed) => continue,
            Err(TryRecvError::Empty) => {}
        }
        match messages.recv_timeout(LOOK_AGAIN) {
            Ok(message) => return Some(message),
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{channel, sync_channel};

    use super::*;

    /// The thread waits for a message that only work can send which comes later; with a limit, so that the
    /// test ends where it never does that work.
    #[test]
    fn who_waits_does_what_comes_meanwhile() {
        const PATIENCE: Duration = Duration::from_secs(60);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let (message_tx, message_rx) = channel();
        let (result_tx, result_rx) = sync_channel(1);
        pool.spawn(move || result_tx.send(next(&message_rx)).unwrap());
        // By now the only thread has found nothing to do; if it has not, the test passes without showing it.
        assert!(result_rx.recv_timeout(Duration::from_millis(100)).is_err());
        let done = message_tx.clone();
        pool.spawn(move || done.send(7).unwrap());
        assert_eq!(result_rx.recv_timeout(PATIENCE), Ok(Some(7)));
    }

    #[test]
    fn a_message_comes_before_work_and_the_end_after_both() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let (message_tx, message_rx) = channel();
        pool.install(move || {
            message_tx.send(1).unwrap();
            rayon::spawn({
                let message_tx = message_tx.clone();
                move || message_tx.send(2).unwrap()
            });
            drop(message_tx);
            let got: [Option<i32>; 3] = std::array::from_fn(|_| next(&message_rx));
            assert_eq!(got, [Some(1), Some(2), None]);
        });
    }
}
