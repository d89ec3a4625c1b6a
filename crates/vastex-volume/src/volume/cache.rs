//! Decoded chunks that are shared: by reads at the same time, of which one decodes a chunk and the others
//! wait for it, and by reads one after the other, for which chunks are kept for a while, the last used ones
//! up to a number of bytes.

use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

use rustc_hash::FxHashMap;

use super::last_used::{Key, LastUsed};
use crate::chunks::Chunk;
use crate::fault::VolumeError;

/// A chunk; `None` if it is absent.
type Outcome = Result<Option<Chunk>, VolumeError>;

/// What became of the chunks that were wanted, counted since a volume was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChunkWork {
    /// Chunks that were read and decoded.
    pub decoded: u64,
    /// Bytes that these had, decoded.
    pub bytes_decoded: u64,
    /// Bytes that were read for them: as they are stored, of TIFF stacks as they are decoded. Indices of
    /// shards and metadata are left out.
    pub bytes_read: u64,
    /// Chunks that were found absent by looking for them.
    pub absent: u64,
    /// How often a chunk was had without reading it: it was kept, or another read had begun with it.
    pub shared: u64,
    /// Chunks that could not be read or decoded.
    pub failed: u64,
    /// Bytes of decoded chunks that are kept now.
    pub bytes_kept: u64,
}

/// How a chunk was had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Had {
    /// The chunk was read, and decoded if it was there.
    Read,
    /// By others.
    Shared,
}

/// Chunks by their place; absent ones are kept, too. Errors are not kept: who asks again reads again.
pub(crate) struct ChunkCache {
    most_bytes: AtomicUsize,
    kept: Mutex<Kept>,
    counts: Counts,
}

#[derive(Default)]
struct Counts {
    decoded: AtomicU64,
    bytes_decoded: AtomicU64,
    bytes_read: AtomicU64,
    absent: AtomicU64,
    shared: AtomicU64,
    failed: AtomicU64,
}

#[derive(Default)]
struct Kept {
    chunks: LastUsed,
    under_way: FxHashMap<Key, Arc<UnderWay>>,
}

impl ChunkCache {
    /// Keeps decoded chunks of up to so many bytes, and of larger ones the last.
    pub(crate) fn new(most_bytes: usize) -> ChunkCache {
        ChunkCache {
            most_bytes: AtomicUsize::new(most_bytes),
            kept: Mutex::default(),
            counts: Counts::default(),
        }
    }

    /// Keeps up to so many bytes from now on; what is more goes at once.
    pub(crate) fn keep_at_most(&self, most_bytes: usize) {
        self.most_bytes.store(most_bytes, Ordering::Relaxed);
        let gone = self.with(|kept| kept.chunks.make_room(most_bytes));
        drop(gone);
    }

    fn most_bytes(&self) -> usize {
        self.most_bytes.load(Ordering::Relaxed)
    }

    /// A chunk that is kept, or that it is known to be absent. Waits for nothing.
    pub(crate) fn find(&self, key: &Key) -> Option<Option<Chunk>> {
        self.with(|kept| kept.chunks.find(key.0, &key.1))
    }

    /// The same for somebody who wants chunks of a level and would else [get](ChunkCache::get) them: their
    /// coordinates lie one after the other, `axes` each.
    pub(crate) fn share(&self, level: usize, coords: &[u64], axes: usize) -> Vec<Option<Option<Chunk>>> {
        let mut found = Vec::with_capacity(coords.len() / axes);
        self.with(|kept| {
            found.extend(coords.chunks_exact(axes).map(|coords| kept.chunks.find(level, coords)));
        });
        let shared = found.iter().flatten().count() as u64;
        self.counts.shared.fetch_add(shared, Ordering::Relaxed);
        found
    }

    /// Returns true if a read has a chunk under way.
    pub(crate) fn is_under_way(&self, key: &Key) -> bool {
        self.with(|kept| kept.under_way.contains_key(key))
    }

    /// A chunk: the one that is kept, or the one that another read is about to have, or what `read` gives,
    /// which is polled only where nobody else reads it. What another read fails with is this one's error,
    /// too; where the other read is dropped, this one reads.
    pub(crate) async fn get(&self, key: Key, read: impl Future<Output = Outcome>) -> (Outcome, Had) {
        let claim = loop {
            let wait = match self.look(&key) {
                Looked::Kept(chunk) => {
                    self.counts.shared.fetch_add(1, Ordering::Relaxed);
                    return (Ok(chunk), Had::Shared);
                }
                Looked::UnderWay(work) => Wait(work),
                Looked::Claimed(work) => break Claim { cache: self, key: &key, work, outcome: None },
            };
            if let Some(outcome) = wait.await {
                self.counts.shared.fetch_add(1, Ordering::Relaxed);
                return (outcome, Had::Shared);
            }
        };
        let outcome = read.await;
        self.counts.count(&outcome);
        claim.end(outcome.clone());
        (outcome, Had::Read)
    }

    /// What was done so far.
    pub(crate) fn work(&self) -> ChunkWork {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let counts = &self.counts;
        ChunkWork {
            decoded: of(&counts.decoded),
            bytes_decoded: of(&counts.bytes_decoded),
            bytes_read: of(&counts.bytes_read),
            absent: of(&counts.absent),
            shared: of(&counts.shared),
            failed: of(&counts.failed),
            bytes_kept: self.with(|kept| kept.chunks.bytes() as u64),
        }
    }

    fn look(&self, key: &Key) -> Looked {
        self.with(|kept| match (kept.chunks.find(key.0, &key.1), kept.under_way.get(key)) {
            (Some(chunk), _) => Looked::Kept(chunk),
            (None, Some(work)) => Looked::UnderWay(work.clone()),
            (None, None) => {
                let work = Arc::new(UnderWay::default());
                kept.under_way.insert(key.clone(), work.clone());
                Looked::Claimed(work)
            }
        })
    }

    fn with<T>(&self, work: impl FnOnce(&mut Kept) -> T) -> T {
        work(&mut self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Counts {
    fn count(&self, outcome: &Outcome) {
        let (counter, bytes, stored) = match outcome {
            Ok(Some(chunk)) => (&self.decoded, chunk.bytes.len() as u64, chunk.stored as u64),
            Ok(None) => (&self.absent, 0, 0),
            Err(_) => (&self.failed, 0, 0),
        };
        self.bytes_read.fetch_add(stored, Ordering::Relaxed);
        counter.fetch_add(1, Ordering::Relaxed);
        self.bytes_decoded.fetch_add(bytes, Ordering::Relaxed);
    }
}

enum Looked {
    Kept(Option<Chunk>),
    UnderWay(Arc<UnderWay>),
    Claimed(Arc<UnderWay>),
}

/// A read that others wait for.
#[derive(Default)]
struct UnderWay {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// `None` within if the read was dropped.
    ended: Option<Option<Outcome>>,
    waits: Vec<Waker>,
}

/// The right to read a chunk for all who want it. Dropped without an end, others may.
struct Claim<'a> {
    cache: &'a ChunkCache,
    key: &'a Key,
    work: Arc<UnderWay>,
    outcome: Option<Outcome>,
}

impl Claim<'_> {
    fn end(mut self, outcome: Outcome) {
        self.outcome = Some(outcome);
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        let outcome = self.outcome.take();
        // Kept before it is taken out of what is under way, so that nobody finds neither. What goes for it is
        // freed without the lock.
        let gone = self.cache.with(|kept| {
            let gone = match &outcome {
                Some(Ok(chunk)) => kept.chunks.keep(self.key, chunk.clone(), self.cache.most_bytes()),
                _ => Vec::new(),
            };
            kept.under_way.remove(self.key);
            gone
        });
        drop(gone);
        let mut state = self.work.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.ended = Some(outcome);
        let waits = std::mem::take(&mut state.waits);
        drop(state);
        waits.into_iter().for_each(Waker::wake);
    }
}

/// Waits for another's read; `None` if that was dropped.
struct Wait(Arc<UnderWay>);

impl Future for Wait {
    type Output = Option<Outcome>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Outcome>> {
        let mut state = self.0.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(ended) = &state.ended {
            return Poll::Ready(ended.clone());
        }
        if !state.waits.iter().any(|waker| waker.will_wake(context.waker())) {
            state.waits.push(context.waker().clone());
        }
        Poll::Pending
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;

    use pollster::block_on;

    use super::*;
    use crate::fault::damaged;

    fn chunk(bytes: usize) -> Chunk {
        Chunk::new(vec![0; bytes], [1, 1], 3)
    }

    async fn found(chunk: Option<Chunk>) -> Outcome {
        Ok(chunk)
    }

    async fn never() -> Outcome {
        panic!("another read has it")
    }

    #[test]
    fn what_is_done_is_counted() {
        let cache = ChunkCache::new(256 << 20);
        for n in 0..30 {
            cache.find(&(0, vec![0]));
            block_on(cache.get((0, vec![n]), found(Some(chunk(20 << 20))))).0.unwrap();
            assert!(cache.work().bytes_kept <= 256 << 20);
        }
        assert!(cache.find(&(0, vec![0])).is_some() && cache.find(&(0, vec![5])).is_none());
        assert!(cache.find(&(1, vec![0])).is_none());
        block_on(cache.get((2, vec![]), found(None))).0.unwrap();
        assert!(matches!(cache.find(&(2, vec![])), Some(None)));
        cache.keep_at_most(50 << 20);
        assert!(cache.find(&(0, vec![0])).is_some() && cache.find(&(0, vec![27])).is_none());
        let work = cache.work();
        assert_eq!((work.decoded, work.absent, work.shared, work.failed), (30, 1, 0, 0));
        assert_eq!((work.bytes_decoded, work.bytes_read), (30 * (20 << 20), 30 * 3));
        assert!(work.bytes_kept > 40 << 20 && work.bytes_kept <= 50 << 20, "{work:?}");
    }

    #[test]
    fn nothing_is_kept_where_nothing_may_be() {
        let cache = ChunkCache::new(1 << 20);
        cache.keep_at_most(0);
        for chunk in [Some(chunk(9)), None] {
            let found = block_on(cache.get((0, vec![1]), found(chunk.clone()))).0.unwrap();
            assert_eq!(found.is_some(), chunk.is_some());
            assert!(cache.find(&(0, vec![1])).is_none());
        }
    }

    #[test]
    fn what_is_kept_is_shared_many_at_once() {
        let cache = ChunkCache::new(1 << 20);
        block_on(cache.get((0, vec![1, 2]), found(Some(chunk(9))))).0.unwrap();
        block_on(cache.get((0, vec![3, 4]), found(None))).0.unwrap();
        let found = cache.share(0, &[1, 2, 3, 4, 5, 6], 2);
        assert!(matches!(&found[..], [Some(Some(_)), Some(None), None]));
        assert_eq!(cache.work().shared, 2);
    }

    /// A read that goes on when it is told to.
    #[derive(Default)]
    struct Gate(Mutex<(bool, Option<Waker>)>);

    impl Gate {
        async fn pass(&self) {
            std::future::poll_fn(|context| {
                let mut state = self.0.lock().unwrap();
                state.1 = Some(context.waker().clone());
                if state.0 { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
        }
    }

    #[test]
    fn reads_at_once_share_one() {
        let (cache, gate) = (ChunkCache::new(1 << 20), Gate::default());
        let read = async {
            gate.pass().await;
            Ok(Some(chunk(5)))
        };
        let mut context = Context::from_waker(Waker::noop());
        let mut first = pin!(cache.get((0, vec![1]), read));
        assert!(first.as_mut().poll(&mut context).is_pending());
        let mut second = pin!(cache.get((0, vec![1]), never()));
        assert!(second.as_mut().poll(&mut context).is_pending());
        gate.0.lock().unwrap().0 = true;
        let Poll::Ready((Ok(Some(_)), Had::Read)) = first.as_mut().poll(&mut context) else { panic!() };
        let Poll::Ready((Ok(Some(_)), Had::Shared)) = second.as_mut().poll(&mut context) else { panic!() };
        assert_eq!(cache.work().decoded, 1);
        assert!(cache.kept.lock().unwrap().under_way.is_empty());
    }

    #[test]
    fn a_read_that_is_dropped_leaves_the_chunk_to_who_waits() {
        let (cache, gate) = (ChunkCache::new(1 << 20), Gate::default());
        let mut context = Context::from_waker(Waker::noop());
        let mut first = Box::pin(cache.get((0, vec![1]), async {
            gate.pass().await;
            Ok(None)
        }));
        assert!(first.as_mut().poll(&mut context).is_pending());
        let mut second = pin!(cache.get((0, vec![1]), found(Some(chunk(7)))));
        assert!(second.as_mut().poll(&mut context).is_pending());
        drop(first);
        let Poll::Ready((Ok(Some(chunk)), Had::Read)) = second.as_mut().poll(&mut context) else { panic!() };
        assert_eq!(chunk.bytes.len(), 7);
    }

    #[test]
    fn errors_are_shared_and_not_kept() {
        let cache = ChunkCache::new(1 << 20);
        let fails = async { Err(damaged("is damaged").at("a/b")) };
        assert!(block_on(cache.get((0, vec![1]), fails)).0.is_err());
        assert!(block_on(cache.get((0, vec![1]), found(None))).0.is_ok());
        assert_eq!((cache.work().failed, cache.work().absent), (1, 1));
    }

    #[test]
    fn threads_that_want_the_same_decode_it_once() {
        let cache = ChunkCache::new(64 << 20);
        std::thread::scope(|scope| {
            for thread in 0..4_u64 {
                let cache = &cache;
                scope.spawn(move || {
                    for n in 0..200 {
                        let key = (0, vec![(n + thread * 7) % 200]);
                        let read = async {
                            std::thread::yield_now();
                            Ok(Some(chunk(100)))
                        };
                        assert!(block_on(cache.get(key, read)).0.unwrap().is_some());
                    }
                });
            }
        });
        let work = cache.work();
        assert_eq!((work.decoded, work.shared), (200, 600));
    }
}
