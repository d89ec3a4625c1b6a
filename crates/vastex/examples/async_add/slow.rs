//! A source that takes its time: a landscape in other colours, each of whose answers takes some time. It
//! counts who asks.

use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use std::thread::{self, ThreadId};
use std::time::Duration;

use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{Description, PagePos, TileSource};

/// A source whose colours are the other's with red and blue exchanged, and whose answers take some time.
pub(crate) struct Slow {
    source: Arc<dyn TileSource>,
    answers_after: Duration,
    /// Of each read begun and each poll the thread.
    asked_by: Arc<Mutex<Vec<ThreadId>>>,
}

impl Slow {
    pub(crate) fn new(source: Arc<dyn TileSource>, answers_after: Duration) -> Slow {
        Slow { source, answers_after, asked_by: Arc::default() }
    }

    /// How many times a thread has begun a read or polled one, and how many times all have.
    pub(crate) fn times_asked(&self, thread: ThreadId) -> (usize, usize) {
        let asked_by = self.asked_by.lock().unwrap_or_else(PoisonError::into_inner);
        (asked_by.iter().filter(|by| **by == thread).count(), asked_by.len())
    }
}

fn note(asked_by: &Mutex<Vec<ThreadId>>) {
    asked_by.lock().unwrap_or_else(PoisonError::into_inner).push(thread::current().id());
}

impl TileSource for Slow {
    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        note(&self.asked_by);
        Box::pin(async move {
            Later::begin(self.answers_after, self.asked_by.clone()).await;
            let texels = self.source.read(pos).await?.bytes;
            let exchanged = texels.chunks_exact(4).flat_map(|texel| [texel[2], texel[1], texel[0], texel[3]]);
            Ok(Tile { codec: Codec::Raw, bytes: exchanged.collect::<Vec<u8>>().into() })
        })
    }
}

/// Ready after some time, as an answer from far away would be.
struct Later {
    is_here: Arc<AtomicBool>,
    waker: Arc<Mutex<Option<Waker>>>,
    asked_by: Arc<Mutex<Vec<ThreadId>>>,
}

impl Later {
    fn begin(time: Duration, asked_by: Arc<Mutex<Vec<ThreadId>>>) -> Later {
        let later = Later { is_here: Arc::default(), waker: Arc::default(), asked_by };
        let (is_here, waker) = (later.is_here.clone(), later.waker.clone());
        thread::spawn(move || {
            thread::sleep(time);
            is_here.store(true, Ordering::SeqCst);
            let waker = waker.lock().unwrap_or_else(PoisonError::into_inner).take();
            waker.into_iter().for_each(Waker::wake);
        });
        later
    }
}

impl Future for Later {
    type Output = ();

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        note(&self.asked_by);
        *self.waker.lock().unwrap_or_else(PoisonError::into_inner) = Some(context.waker().clone());
        if self.is_here.load(Ordering::SeqCst) { Poll::Ready(()) } else { Poll::Pending }
    }
}
