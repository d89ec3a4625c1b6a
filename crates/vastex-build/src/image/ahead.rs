//! Pieces of an image that are decoded ahead of the rows, by whoever has nothing else to do, and given out in
//! their order.
//!
//! Reading is mostly decoding, and strips, tiles and blocks, or rows whose colours are converted, are decoded
//! each by itself. A reader says what there is to do, as far as there is room ([`Ahead::has_room`],
//! [`Ahead::push`]), and takes the results in the same order ([`Ahead::next`]). Idle threads of a build's
//! pool do the pieces; the thread that reads does them too where it would have to wait, so nothing depends on
//! anybody's help. Without help a piece is done when it is asked for.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

/// Bytes that all pieces of one reader take at most which are decoded ahead.
const MOST_BYTES: u64 = 256 << 20;

/// Threads that help a reader to decode ahead of the rows that are asked for. Builds have some.
#[derive(Clone)]
pub struct Helpers {
    pool: Arc<rayon::ThreadPool>,
    pieces: usize,
    #[cfg(test)]
    watch: Option<Watch>,
}

/// Told of every piece that is begun, on the thread that does it.
#[cfg(test)]
pub(crate) type Watch = Arc<dyn Fn() + Send + Sync>;

impl Helpers {
    /// The threads of a pool, which decode so many pieces ahead for each reader.
    pub(crate) fn new(pool: Arc<rayon::ThreadPool>, pieces: usize) -> Helpers {
        Helpers {
            pool,
            pieces,
            #[cfg(test)]
            watch: None,
        }
    }

    #[cfg(test)]
    pub(crate) fn watched(threads: usize, pieces: usize, watch: Watch) -> Helpers {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        Helpers { watch: Some(watch), ..Helpers::new(Arc::new(pool), pieces) }
    }
}

type Job<R> = Box<dyn FnOnce() -> R + Send>;

enum Piece<R> {
    Waiting(Job<R>),
    /// Somebody does it, or nobody will since nobody asks for it any more.
    Begun,
    Done(thread::Result<R>),
}

struct Place<R> {
    piece: Mutex<Piece<R>>,
    done: Condvar,
}

impl<R> Place<R> {
    /// Does the piece, unless somebody has begun it; returns true if it did.
    fn work(&self) -> bool {
        let mut piece = self.lock();
        let job = match std::mem::replace(&mut *piece, Piece::Begun) {
            Piece::Waiting(job) => job,
            other => {
                *piece = other;
                return false;
            }
        };
        drop(piece);
        let result = catch_unwind(AssertUnwindSafe(job));
        *self.lock() = Piece::Done(result);
        self.done.notify_all();
        true
    }

    /// What was made of the piece; `None` while it is not done.
    fn take(&self) -> Option<thread::Result<R>> {
        let mut piece = self.lock();
        match std::mem::replace(&mut *piece, Piece::Begun) {
            Piece::Done(result) => Some(result),
            other => {
                *piece = other;
                None
            }
        }
    }

    /// Waits until a piece is done that somebody does.
    fn wait(&self) {
        let is_begun = |piece: &mut Piece<R>| matches!(piece, Piece::Begun);
        drop(self.done.wait_while(self.lock(), is_begun).unwrap_or_else(PoisonError::into_inner));
    }

    /// No job runs while the lock is held.
    fn lock(&self) -> MutexGuard<'_, Piece<R>> {
        self.piece.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Pieces in their order, from the one that is asked for next to the one that was pushed last.
pub(super) struct Ahead<R> {
    helpers: Option<Helpers>,
    places: VecDeque<Arc<Place<R>>>,
    /// Pieces that there are in all, and bytes that each takes while it is there.
    count: u64,
    bytes: u64,
}

impl<R: Send + 'static> Ahead<R> {
    /// For an image of so many pieces, of so many bytes each.
    pub(super) fn new(count: u64, bytes: u64) -> Ahead<R> {
        Ahead { helpers: None, places: VecDeque::new(), count, bytes }
    }

    /// Of `pieces` that could be decoded ahead, how many are: all but the one that is asked for, while they
    /// do not take too much.
    fn limited(&self, pieces: usize) -> usize {
        let most = (MOST_BYTES / self.bytes.max(1)).min(self.count.saturating_sub(1));
        pieces.min(usize::try_from(most).unwrap_or(usize::MAX))
    }

    /// Bytes of the pieces that are decoded ahead, where that would be `pieces`.
    pub(super) fn memory(&self, pieces: usize) -> u64 {
        self.limited(pieces) as u64 * self.bytes
    }

    /// To be called before the first piece.
    pub(super) fn take_help(&mut self, helpers: &Helpers) {
        let pieces = self.limited(helpers.pieces);
        self.helpers = (pieces > 0).then(|| Helpers { pieces, ..helpers.clone() });
    }

    /// Returns true if one more piece may be pushed.
    pub(super) fn has_room(&self) -> bool {
        self.places.len() <= self.helpers.as_ref().map_or(0, |helpers| helpers.pieces)
    }

    /// Gives a piece to whoever does it.
    pub(super) fn push(&mut self, job: impl FnOnce() -> R + Send + 'static) {
        let job: Job<R> = Box::new(job);
        #[cfg(test)]
        let job = match self.helpers.as_ref().and_then(|helpers| helpers.watch.clone()) {
            Some(watch) => Box::new(move || {
                watch();
                job()
            }),
            None => job,
        };
        let place = Arc::new(Place { piece: Mutex::new(Piece::Waiting(job)), done: Condvar::new() });
        self.places.push_back(place.clone());
        if let Some(helpers) = &self.helpers {
            helpers.pool.spawn_fifo(move || {
                place.work();
            });
        }
    }

    /// What was made of the next piece, in the order in which they were pushed; `None` if none is left.
    pub(super) fn next(&mut self) -> Option<R> {
        let first = self.places.front()?.clone();
        loop {
            if let Some(result) = first.take() {
                self.places.pop_front();
                return Some(result.unwrap_or_else(|panic| resume_unwind(panic)));
            }
            // While somebody else does the first one, a later one can be done.
            if !self.places.iter().any(|place| place.work()) {
                first.wait();
            }
        }
    }
}

impl<R> Drop for Ahead<R> {
    /// What nobody has begun is not done any more.
    fn drop(&mut self) {
        for place in &self.places {
            let mut piece = place.lock();
            if matches!(*piece, Piece::Waiting(_)) {
                *piece = Piece::Begun;
            }
        }
    }
}

/// Buffers, or whatever else can be used again, of all threads.
pub(super) struct Spare<T>(Mutex<Vec<T>>);

impl<T> Default for Spare<T> {
    fn default() -> Spare<T> {
        Spare(Mutex::default())
    }
}

impl<T> Spare<T> {
    pub(super) fn take(&self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop()
    }

    pub(super) fn give(&self, one: T) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(one);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use super::*;

    /// How long somebody waits for the others, where they never come.
    const PATIENCE: Duration = Duration::from_secs(240);

    /// Counts those who are at work at once: everybody stays until so many have been there together.
    #[derive(Default)]
    pub(crate) struct Rendezvous {
        /// The threads that are there, the most that ever were, and whether somebody has lost patience.
        there: Mutex<(usize, usize, bool)>,
        came: Condvar,
    }

    impl Rendezvous {
        pub(crate) fn watch(self: &Arc<Self>, wanted: usize) -> Watch {
            let rendezvous = self.clone();
            Arc::new(move || {
                let mut there = rendezvous.there.lock().unwrap();
                there.0 += 1;
                there.1 = there.1.max(there.0);
                rendezvous.came.notify_all();
                let alone = |there: &mut (usize, usize, bool)| there.1 < wanted && !there.2;
                let (mut there, waited) = rendezvous.came.wait_timeout_while(there, PATIENCE, alone).unwrap();
                there.0 -= 1;
                there.2 |= waited.timed_out();
            })
        }

        pub(crate) fn most(&self) -> usize {
            self.there.lock().unwrap().1
        }
    }

    #[test]
    fn pieces_are_done_at_once_and_come_in_their_order() {
        let rendezvous = Arc::new(Rendezvous::default());
        let mut ahead = Ahead::new(100, 1);
        ahead.take_help(&Helpers::watched(3, 6, rendezvous.watch(4)));
        let (mut pushed, mut got) = (0, Vec::new());
        loop {
            while ahead.has_room() && pushed < 100 {
                let number = pushed;
                ahead.push(move || number);
                pushed += 1;
            }
            match ahead.next() {
                Some(number) => got.push(number),
                None => break,
            }
            assert!(pushed - got.len() <= 6, "a piece too much is there");
        }
        assert_eq!(got, (0..100).collect::<Vec<_>>());
        // Three helpers, and the thread that asks.
        assert_eq!(rendezvous.most(), 4);
    }

    #[test]
    fn without_help_a_piece_is_done_when_it_is_asked_for() {
        let done = Arc::new(AtomicUsize::new(0));
        let mut ahead = Ahead::new(9, 1);
        for n in 1..4 {
            assert!(ahead.has_room());
            let counted = done.clone();
            ahead.push(move || counted.fetch_add(1, Ordering::Relaxed));
            assert!(!ahead.has_room() && done.load(Ordering::Relaxed) == n - 1);
            assert_eq!(ahead.next(), Some(n - 1));
        }
        assert_eq!(ahead.next(), None);
    }

    #[test]
    fn memory_is_bounded_by_the_pieces_that_there_are_and_by_bytes() {
        assert_eq!(Ahead::<()>::new(5, 1000).memory(100), 4000);
        assert_eq!(Ahead::<()>::new(1, 1000).memory(100), 0);
        assert_eq!(Ahead::<()>::new(0, 0).memory(100), 0);
        assert_eq!(Ahead::<()>::new(1000, 100 << 20).memory(100), 200 << 20);
        assert_eq!(Ahead::<()>::new(1000, MOST_BYTES + 1).memory(100), 0);
    }

    #[test]
    fn a_panic_in_a_piece_reaches_who_asks_for_it() {
        let mut ahead = Ahead::<u8>::new(3, 1);
        ahead.push(|| resume_unwind(Box::new(7u8)));
        let panic = catch_unwind(AssertUnwindSafe(|| ahead.next())).unwrap_err();
        assert_eq!(panic.downcast_ref(), Some(&7u8));
    }
}
