//! Reads in flight: threads that each carry out one blocking read, behind futures that wait for them.
//!
//! What a read does is the caller's business. A future that is dropped takes its read out of the queue; one that is
//! under way ends, and its bytes go nowhere.

use std::collections::VecDeque;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Waker};
use std::thread::{self, JoinHandle};

use bytes::Bytes;

use super::StoreError;

type Read = Result<Bytes, StoreError>;

/// A bounded number of threads, and the reads that wait for one.
#[derive(Debug)]
pub(super) struct InFlight {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    queue: Mutex<Queue>,
    /// Signalled when there may be something to do.
    work: Condvar,
}

#[derive(Debug, Default)]
struct Queue {
    jobs: VecDeque<Job>,
    stopping: bool,
}

#[derive(Debug)]
struct Job {
    offset: u64,
    len: usize,
    /// Gone when nobody waits for the bytes any more.
    answer: Weak<Answer>,
}

/// One read's way from the thread that carries it out to the future that waits.
#[derive(Debug, Default)]
struct Answer {
    state: Mutex<AnswerState>,
}

#[derive(Debug, Default)]
struct AnswerState {
    read: Option<Read>,
    waker: Option<Waker>,
}

/// Nothing that is done behind these locks can panic half-way.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl InFlight {
    /// At most `depth` reads at a time, fewer where the system gives fewer threads; nothing where it gives none.
    ///
    /// `reader` makes what a thread reads with, once for each, so that a thread may keep a buffer.
    pub(super) fn start<R>(depth: usize, reader: impl Fn() -> R) -> Option<InFlight>
    where
        R: FnMut(u64, usize) -> Read + Send + 'static,
    {
        let shared = Arc::<Shared>::default();
        let spawn = |n| {
            let (shared, mut read) = (shared.clone(), reader());
            let thread = thread::Builder::new().name(format!("vastex read {n}"));
            thread.spawn(move || carry_out(&shared, &mut read)).ok()
        };
        let threads: Vec<_> = (0..depth).map_while(spawn).collect();
        (!threads.is_empty()).then_some(InFlight { shared, threads })
    }

    /// The bytes of a range, which is queued when the future is first polled.
    pub(super) async fn read(&self, offset: u64, len: usize) -> Read {
        let answer = Arc::<Answer>::default();
        lock(&self.shared.queue).jobs.push_back(Job { offset, len, answer: Arc::downgrade(&answer) });
        self.shared.work.notify_one();
        Waiting(answer).await
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        lock(&self.shared.queue).stopping = true;
        self.shared.work.notify_all();
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a thread that reads panicked");
            }
        }
    }
}

/// What each thread does until the store is dropped.
fn carry_out(shared: &Shared, read: &mut impl FnMut(u64, usize) -> Read) {
    while let Some(Job { offset, len, answer }) = next_job(shared) {
        // Looked at only, so that the answer is gone as soon as its future is.
        if answer.strong_count() == 0 {
            continue;
        }
        let read = read(offset, len);
        if let Some(answer) = answer.upgrade() {
            answer.give(read);
        }
    }
}

fn next_job(shared: &Shared) -> Option<Job> {
    let mut queue = lock(&shared.queue);
    loop {
        if queue.stopping {
            return None;
        }
        if let Some(job) = queue.jobs.pop_front() {
            return Some(job);
        }
        queue = shared.work.wait(queue).unwrap_or_else(PoisonError::into_inner);
    }
}

impl Answer {
    fn give(&self, read: Read) {
        let waker = {
            let mut state = lock(&self.state);
            state.read = Some(read);
            state.waker.take()
        };
        // Outside the lock, which whoever wakes up asks for.
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

struct Waiting(Arc<Answer>);

impl Future for Waiting {
    type Output = Read;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Read> {
        let mut state = lock(&self.0.state);
        match state.read.take() {
            Some(read) => Poll::Ready(read),
            None => {
                state.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::task::Wake;

    use super::*;

    /// A read gives `len` bytes of the offset.
    fn bytes(offset: u64, len: usize) -> Read {
        Ok(vec![offset as u8; len].into())
    }

    #[test]
    fn as_many_reads_are_under_way_as_there_are_threads() {
        let barrier = Arc::new(std::sync::Barrier::new(3));
        let pool = InFlight::start(3, || {
            let barrier = barrier.clone();
            // Passed only by three reads together.
            move |offset, len| {
                barrier.wait();
                bytes(offset, len)
            }
        });
        let pool = pool.unwrap();
        thread::scope(|scope| {
            let reads: Vec<_> = (0..6)
                .map(|n| {
                    scope.spawn({
                        let pool = &pool;
                        move || pollster::block_on(pool.read(n, 4))
                    })
                })
                .collect();
            for (n, read) in reads.into_iter().enumerate() {
                assert_eq!(read.join().unwrap().unwrap(), vec![n as u8; 4]);
            }
        });
    }

    #[test]
    fn a_read_whose_future_is_dropped_is_never_begun() {
        let (go, gate) = mpsc::channel::<()>();
        let gate = Arc::new(Mutex::new(gate));
        let begun = Arc::new(Mutex::new(Vec::new()));
        let pool = InFlight::start(1, || {
            let (gate, begun) = (gate.clone(), begun.clone());
            move |offset, len| {
                lock(&begun).push(offset);
                lock(&gate).recv().unwrap();
                bytes(offset, len)
            }
        });
        let pool = pool.unwrap();
        let mut context = Context::from_waker(Waker::noop());
        let mut reads: Vec<_> = (0..4).map(|n| Box::pin(pool.read(n, 1))).collect();
        assert!(reads.iter_mut().all(|read| read.as_mut().poll(&mut context).is_pending()));
        // The first is under way, the others are queued.
        while lock(&begun).is_empty() {
            thread::yield_now();
        }
        drop(reads.drain(..3));
        for _ in 0..2 {
            go.send(()).unwrap();
        }
        assert_eq!(pollster::block_on(reads.remove(0)).unwrap(), [3][..]);
        assert_eq!(*lock(&begun), [0, 3]);
    }

    #[test]
    fn the_newest_waker_is_woken() {
        struct Called(mpsc::Sender<&'static str>, &'static str);
        impl Wake for Called {
            fn wake(self: Arc<Self>) {
                self.0.send(self.1).unwrap();
            }
        }
        let (go, gate) = mpsc::channel::<()>();
        let gate = Arc::new(Mutex::new(gate));
        let pool = InFlight::start(1, || {
            let gate = gate.clone();
            move |offset, len| {
                lock(&gate).recv().unwrap();
                bytes(offset, len)
            }
        });
        let (pool, (called, calls)) = (pool.unwrap(), mpsc::channel());
        let mut read = Box::pin(pool.read(7, 1));
        for name in ["first", "second"] {
            let waker = Waker::from(Arc::new(Called(called.clone(), name)));
            assert!(read.as_mut().poll(&mut Context::from_waker(&waker)).is_pending());
        }
        go.send(()).unwrap();
        assert_eq!(calls.recv().unwrap(), "second");
        let ready = read.as_mut().poll(&mut Context::from_waker(Waker::noop()));
        assert!(matches!(ready, Poll::Ready(Ok(bytes)) if bytes == [7][..]));
    }
}
