//! The threads that filter and encode.

use std::thread::available_parallelism;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// The system does not start as many threads as were asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cannot start {threads} threads: {why}; ask for fewer")]
pub struct ThreadsError {
    /// Threads asked for.
    pub threads: usize,
    /// What the system said.
    pub why: String,
}

/// How many threads there are where `threads` are asked for: as many as there are cores for 0.
pub(crate) fn count(threads: usize) -> usize {
    match threads {
        0 => available_parallelism().map_or(1, usize::from),
        n => n,
    }
}

/// So many threads, or one for each core for 0.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool, ThreadsError> {
    let threads = count(threads);
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("vastex-build-{i}"))
        .build()
        .map_err(|e| ThreadsError { threads, why: e.to_string() })
}
