//! How much is decoded at once: chunks of up to so many bytes together, and one that has more alone. Threads
//! that read want one chunk each, and a chunk may have a gibibyte.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

/// Lets bytes in while there is room, and one who wants more than there ever is when nobody else is in.
pub(crate) struct Gate {
    most: u64,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    within: u64,
    waits: Vec<Waker>,
}

impl Gate {
    /// Of so many bytes at once.
    pub(crate) fn new(most: u64) -> Gate {
        Gate { most, state: Mutex::default() }
    }

    /// Waits until there is room for so many bytes, and has them until the turn is dropped.
    pub(crate) fn pass(&self, bytes: u64) -> Pass<'_> {
        // Who has nothing is in nonetheless.
        Pass { gate: self, bytes: bytes.max(1) }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Waits for a turn.
pub(crate) struct Pass<'a> {
    gate: &'a Gate,
    bytes: u64,
}

impl<'a> Future for Pass<'a> {
    type Output = Turn<'a>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Turn<'a>> {
        let (gate, bytes) = (self.gate, self.bytes);
        let mut state = gate.lock();
        if state.within == 0 || state.within.saturating_add(bytes) <= gate.most {
            state.within = state.within.saturating_add(bytes);
            return Poll::Ready(Turn { gate, bytes });
        }
        if !state.waits.iter().any(|waker| waker.will_wake(context.waker())) {
            state.waits.push(context.waker().clone());
        }
        Poll::Pending
    }
}

/// Bytes that are in.
pub(crate) struct Turn<'a> {
    gate: &'a Gate,
    bytes: u64,
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        let mut state = self.gate.lock();
        state.within -= self.bytes;
        let waits = std::mem::take(&mut state.waits);
        drop(state);
        waits.into_iter().for_each(Waker::wake);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    use pollster::block_on;

    use super::*;
    use crate::chunks::{AxisMap, ChunkFuture, ChunkSource, Grid, Presence, PresenceFuture};
    use crate::values::DType;
    use crate::volume::{LevelArray, Volume, VolumeRegion};

    /// Bytes that are in now, and the most that were.
    #[derive(Default)]
    struct Seen {
        now: AtomicU64,
        most: AtomicU64,
    }

    impl Seen {
        fn hold(&self, bytes: u64, long: Duration) {
            self.most.fetch_max(self.now.fetch_add(bytes, Ordering::SeqCst) + bytes, Ordering::SeqCst);
            std::thread::sleep(long);
            self.now.fetch_sub(bytes, Ordering::SeqCst);
        }
    }

    #[test]
    fn so_many_are_in_and_who_is_larger_is_alone() {
        let (gate, seen, alone) = (Gate::new(100), Seen::default(), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for thread in 0..6_u64 {
                let (gate, seen, alone) = (&gate, &seen, &alone);
                scope.spawn(move || {
                    for n in 0..40 {
                        if (n + thread) % 10 == 0 {
                            let _turn = block_on(gate.pass(1000));
                            assert_eq!(seen.now.load(Ordering::SeqCst), 0);
                            alone.fetch_add(1, Ordering::SeqCst);
                        }
                        let _turn = block_on(gate.pass(30));
                        seen.hold(30, Duration::from_micros(200));
                    }
                });
            }
        });
        assert_eq!((alone.into_inner(), gate.lock().within), (24, 0));
        let most = seen.most.into_inner();
        assert!((30..=90).contains(&most), "{most}");
    }

    #[test]
    fn who_no_longer_waits_is_not_waited_for() {
        let gate = Gate::new(10);
        let mut context = Context::from_waker(Waker::noop());
        let first = block_on(gate.pass(8));
        let mut second = Box::pin(gate.pass(8));
        assert!(second.as_mut().poll(&mut context).is_pending());
        drop(second);
        assert_eq!(block_on(gate.pass(2)).bytes, 2);
        drop(first);
        assert_eq!(block_on(gate.pass(0)).bytes, 1);
        assert_eq!(gate.lock().within, 0);
    }

    /// Chunks that take a while, and turn out to be absent.
    struct Slow(Arc<Seen>, u64);

    impl ChunkSource for Slow {
        fn read<'a>(&'a self, _: &'a [u64]) -> ChunkFuture<'a> {
            Box::pin(async move {
                self.0.hold(self.1, Duration::from_millis(5));
                Ok(None)
            })
        }

        fn fill(&self) -> [u8; 8] {
            [7; 8]
        }

        fn presence(&self, _: usize) -> PresenceFuture<'_> {
            Box::pin(async { Ok(Presence::All) })
        }
    }

    #[test]
    fn a_volume_decodes_a_gibibyte_at_once() {
        let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/v05-flat.zip");
        let crate::Opened::Volume(opened) = crate::open(&fixture).unwrap() else { panic!("no volume") };
        for (chunk, at_once) in [(600 << 20, 1), (400 << 20, 2), (90 << 20, 6)] {
            let (seen, count) = (Arc::new(Seen::default()), 6.min((1 << 31) / chunk));
            let mut about = opened.about().clone();
            about.dtype = DType::U8;
            about.levels.truncate(1);
            (about.levels[0].size, about.levels[0].chunk) = ([count * chunk, 1, 1], [chunk, 1, 1]);
            let axes = AxisMap { x: 2, y: 1, z: Some(0), channel: None, time: None };
            let grid = Grid { shape: vec![1, 1, count * chunk], chunk: vec![1, 1, chunk], axes };
            let source = Arc::new(Slow(seen.clone(), chunk));
            let volume = Volume::new(about, vec![LevelArray { dtype: DType::U8, grid, source }]);
            std::thread::scope(|scope| {
                for n in 0..count {
                    let volume = &volume;
                    scope.spawn(move || {
                        let at = [n * chunk, 0, 0];
                        let region = VolumeRegion { level: 0, channel: 0, time: 0, at, size: [1; 3] };
                        assert_eq!(block_on(volume.read(&region)).unwrap(), [7]);
                    });
                }
            });
            let most = seen.most.load(Ordering::SeqCst);
            assert!(most <= at_once * chunk && most >= chunk, "{most} of chunks of {chunk}");
            assert_eq!(volume.chunk_work().absent, count);
        }
    }
}
