//! How many files a reader may keep open at once: the system lets a program open only so many (`ulimit -n`).

use std::sync::atomic::{AtomicUsize, Ordering};

/// Files that are left to everything else: the output, libraries, threads that read ahead.
const OTHERS: usize = 128;
/// What is reserved by all readers of this program.
static RESERVED: AtomicUsize = AtomicUsize::new(0);

/// Files that may be open at once, as long as this lives.
#[derive(Debug)]
pub(super) struct OpenFiles(usize);

impl OpenFiles {
    /// As many of the `wanted` ones as there are. Raises this program's limit first, where that is too low
    /// and the system lets it.
    pub(super) fn reserve(wanted: usize) -> OpenFiles {
        let limit = limit_for(RESERVED.load(Ordering::Relaxed).saturating_add(wanted).saturating_add(OTHERS));
        let mut count = 0;
        let take = |reserved: usize| {
            count = wanted.min(limit.saturating_sub(OTHERS).saturating_sub(reserved));
            Some(reserved + count)
        };
        // Always some: the function never refuses.
        let _ = RESERVED.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take);
        OpenFiles(count)
    }

    pub(super) fn count(&self) -> usize {
        self.0
    }

    #[cfg(test)]
    pub(super) fn for_test(count: usize) -> OpenFiles {
        RESERVED.fetch_add(count, Ordering::Relaxed);
        OpenFiles(count)
    }
}

impl Drop for OpenFiles {
    fn drop(&mut self) {
        RESERVED.fetch_sub(self.0, Ordering::Relaxed);
    }
}

/// The limit of open files, raised if it is below `wanted` and may be.
#[cfg(unix)]
fn limit_for(wanted: usize) -> usize {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    // Without a number there is no limit.
    let limit = current.map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX));
    if limit >= wanted {
        return limit;
    }
    let raised = maximum.map_or(wanted as u64, |most| most.min(wanted as u64));
    match setrlimit(Resource::Nofile, Rlimit { current: Some(raised), maximum }) {
        Ok(()) => raised as usize,
        Err(_) => limit,
    }
}

/// Other systems allow more than anybody has in a row.
#[cfg(not(unix))]
fn limit_for(_: usize) -> usize {
    1 << 13
}
