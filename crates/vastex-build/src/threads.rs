//! The threads that filter and encode, and the loops whose rounds they share.
//!
//! What a round does is each caller's own; how rounds are spread over threads is compiled once, for all of
//! them, since a loop of rayon's is hundreds of functions.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::available_parallelism;

use rayon::prelude::*;
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
    start(count(threads), || {})
}

/// Threads that give way to others of the program and of the machine ([`give_way`]); where the
/// system has no such threads one fewer, so that a core is left to others.
pub(crate) fn pool_that_gives_way(threads: usize) -> Result<ThreadPool, ThreadsError> {
    let threads = count(threads);
    start(if CAN_GIVE_WAY { threads } else { (threads - 1).max(1) }, || {
        give_way();
    })
}

fn start(threads: usize, begin: fn()) -> Result<ThreadPool, ThreadsError> {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("vastex-build-{i}"))
        .start_handler(move |_| begin())
        .build()
        .map_err(|e| ThreadsError { threads, why: e.to_string() })
}

/// True if threads of one program have priorities of their own that may be lowered.
const CAN_GIVE_WAY: bool = cfg!(target_os = "linux");
/// By how much less urgent threads are that give way, of the 20 steps that there are: beside a busy thread
/// they get a tenth of a core, so that what they do always goes on.
#[cfg(target_os = "linux")]
const STEPS: i32 = 10;

/// Has the calling thread, and those that it starts from now on, give way to other threads of the program and
/// of the machine, for good: where all cores are busy it gets a tenth of one, else as much as ever. For work
/// beside something that a person looks at. Returns true if it does from now on: on Linux; on other systems
/// nothing is changed.
pub fn give_way() -> bool {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{getpid, getpriority_process, setpriority_process};
        // A number of 0 is the calling thread, that of the program its first one, of which others begin as
        // urgent.
        let of_program = getpriority_process(Some(getpid())).unwrap_or(0);
        let urgency = of_program.saturating_add(STEPS).min(19);
        getpriority_process(None).is_ok_and(|now| now >= urgency)
            || setpriority_process(None, urgency).is_ok()
    }
    #[cfg(not(target_os = "linux"))]
    CAN_GIVE_WAY
}

/// What `make` makes of each item, in the order of the items.
///
/// Items are made side by side by the threads of the pool that the caller runs in, else by those of rayon's
/// own; which thread takes which item, and when, is left open. A thread takes at least `least` neighbouring
/// items at a time where there are so many, so that little work is not shared at all. The items themselves
/// are listed by the calling thread before any is made. Costs a lock and some bytes for each item, so an item
/// is best a row of texels or more. A list of `()` takes no memory. Panics if `make` does, once no item is
/// worked on any more.
pub(crate) fn map<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    least: usize,
    make: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    // Lists are filled by plain loops: chains of iterators are many more functions for each caller.
    let items = items.into_iter();
    let mut slots = Vec::with_capacity(items.size_hint().0);
    for item in items {
        slots.push(Mutex::new((Some(item), None)));
    }
    // Each slot is locked by the one round that is its own, so nobody waits, and none is poisoned where the
    // loop comes to its end.
    each(slots.len(), least, &|i| {
        if let Ok(mut slot) = slots[i].lock()
            && let Some(item) = slot.0.take()
        {
            slot.1 = Some(make(item));
        }
    });
    let mut made = Vec::with_capacity(slots.len());
    for slot in slots {
        // All are full: the loop took every item.
        if let Ok((_, Some(result))) = slot.into_inner() {
            made.push(result);
        }
    }
    made
}

/// What `make` makes of each item, in the order of the items, or why it failed: of the errors that came up,
/// that of the first item.
///
/// As [`map`] with no least number of items for a thread. Once `make` has failed, items that no thread has
/// begun are left out; so which error is returned may depend on which items were begun.
pub(crate) fn try_map<T: Send, R: Send, E: Send>(
    items: impl IntoIterator<Item = T>,
    make: impl Fn(T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let failed = AtomicBool::new(false);
    let results = map(items, 1, |item| {
        if failed.load(Ordering::Relaxed) {
            return None;
        }
        let result = make(item);
        if result.is_err() {
            failed.store(true, Ordering::Relaxed);
        }
        Some(result)
    });
    let mut made = Vec::with_capacity(results.len());
    for result in results.into_iter().flatten() {
        made.push(result?);
    }
    Ok(made)
}

/// Calls `run` with each number below `count`, side by side. The only place that names rayon's iterators.
fn each(count: usize, least: usize, run: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().with_min_len(least).for_each(run);
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

    #[test]
    fn what_is_made_comes_in_the_order_of_its_items() {
        let pool = pool(3).unwrap();
        for (count, least) in [(0, 1), (1, 0), (1000, 1), (1000, 300), (10, 1000)] {
            let made = pool.install(|| map(0..count, least, |item| item.to_string()));
            assert_eq!(made, (0..count).map(|item| item.to_string()).collect::<Vec<_>>());
        }
    }

    /// Each thread of such a pool, and none of others, whose makers stay as they are.
    #[cfg(target_os = "linux")]
    #[test]
    fn threads_that_give_way_are_less_urgent_than_those_of_the_program() {
        let urgency = || rustix::process::getpriority_process(None).unwrap();
        let of = |pool: ThreadPool| pool.broadcast(|_| urgency());
        let mine = urgency();
        assert_eq!(of(pool(2).unwrap()), [mine; 2]);
        assert!(of(pool_that_gives_way(2).unwrap()).iter().all(|there| *there > mine));
        assert_eq!(urgency(), mine);
        // What a thread starts once it gives way does so too, and no more than it.
        let [first, again, started] = std::thread::scope(|scope| {
            let gives_way = || {
                let [first, again] = [(); 2].map(|()| (give_way(), urgency()).1);
                let started = std::thread::spawn(urgency).join().unwrap();
                [first, again, started]
            };
            scope.spawn(gives_way).join().unwrap()
        });
        assert!(first > mine && again == first && started == first, "{first}, {again}, {started}");
    }

    #[test]
    fn items_can_be_written_to_and_are_given_away() {
        let mut rows = vec![0u8; 12];
        let owned = ["a", "bc", "def"].map(String::from);
        pool(2).unwrap().install(|| {
            map(rows.chunks_exact_mut(4).zip(owned), 1, |(row, text): (&mut [u8], String)| {
                row[..text.len()].copy_from_slice(text.as_bytes());
            })
        });
        assert_eq!(rows, *b"a\0\0\0bc\0\0def\0");
    }

    #[test]
    fn after_a_failure_nothing_is_begun_and_the_first_error_is_told() {
        let begun = AtomicUsize::new(0);
        let make = |item: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if item < 5 { Ok(item) } else { Err(item) }
        };
        // One thread takes the items in their order.
        assert_eq!(pool(1).unwrap().install(|| try_map(0..1000, make)), Err(5));
        assert_eq!(begun.into_inner(), 6);
        let all_fail = pool(3).unwrap().install(|| try_map(0..1000, Err::<(), usize>));
        assert!(all_fail.is_err());
        assert_eq!(try_map(0..3, Ok::<usize, ()>), Ok(vec![0, 1, 2]));
    }
}
