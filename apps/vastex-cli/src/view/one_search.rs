//! A search on a thread, one at a time: who begins another does not wait for the one before any more, which
//! is told so and says nothing.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use anyhow::{Context, Result, anyhow};

/// Looks for something; asks now and then whether it is over.
type Look<T> = Box<dyn FnOnce(&dyn Fn() -> bool) -> Result<T> + Send>;
/// Hears what was found.
type Tell<T> = Box<dyn FnOnce(Result<T>) + Send>;

/// What is looked for, and the thread that does.
pub(super) struct OneSearch<T> {
    asked: Arc<Mutex<Asked<T>>>,
    /// Of the search that was begun last.
    number: Arc<AtomicU64>,
    /// Ends all of them.
    stop: Arc<AtomicBool>,
}

struct Asked<T> {
    next: Option<(u64, Look<T>, Tell<T>)>,
    is_running: bool,
}

impl<T: Send + 'static> OneSearch<T> {
    /// None yet; `stop` ends whichever is begun.
    pub(super) fn new(stop: Arc<AtomicBool>) -> OneSearch<T> {
        let asked = Arc::new(Mutex::new(Asked { next: None, is_running: false }));
        OneSearch { asked, number: Arc::default(), stop }
    }

    /// Begins a search, and ends the one before. A panic of it is told as a fault of what is at `path`.
    pub(super) fn begin(
        &self,
        path: &str,
        look: impl FnOnce(&dyn Fn() -> bool) -> Result<T> + Send + 'static,
        tell: impl FnOnce(Result<T>) + Send + 'static,
    ) -> Result<()> {
        let number = self.number.fetch_add(1, Ordering::Relaxed) + 1;
        {
            let mut asked = lock(&self.asked);
            asked.next = Some((number, Box::new(look), Box::new(tell)));
            if std::mem::replace(&mut asked.is_running, true) {
                return Ok(());
            }
        }
        let (asked, latest, stop) = (self.asked.clone(), self.number.clone(), self.stop.clone());
        let path = path.to_owned();
        let work = move || {
            loop {
                let next = {
                    let mut asked = lock(&asked);
                    let next = asked.next.take().filter(|_| !stop.load(Ordering::Relaxed));
                    asked.is_running = next.is_some();
                    next
                };
                let Some((number, look, tell)) = next else { return };
                let is_over = || stop.load(Ordering::Relaxed) || latest.load(Ordering::Relaxed) != number;
                let found = guarded(&path, || look(&is_over));
                if !is_over() {
                    tell(found);
                }
            }
        };
        let begun = thread::Builder::new().name("vastex-search".into()).spawn(work);
        if begun.is_err() {
            *lock(&self.asked) = Asked { next: None, is_running: false };
        }
        begun.map(drop).context("no thread can be started to search the volume")
    }
}

/// What is locked is whole at any moment.
fn lock<T>(asked: &Mutex<Asked<T>>) -> MutexGuard<'_, Asked<T>> {
    asked.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does something of which a panic is an error like others, so that whoever waits for it hears of that.
pub(super) fn guarded<T>(path: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        Err(anyhow!("{path}: cannot be read; why was said where the program was started"))
    })
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::time::{Duration, Instant};

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(60);

    /// Looks until it is over, and says whether that was so.
    fn forever(is_over: &dyn Fn() -> bool) -> bool {
        let begun = Instant::now();
        while !is_over() && begun.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(1));
        }
        is_over()
    }

    #[test]
    fn the_newest_search_ends_those_before_and_they_say_nothing() {
        let search = OneSearch::new(Arc::default());
        let (ended, was_ended) = channel();
        let (tell, told) = channel();
        for nth in 0..5 {
            let (ended, tell) = (ended.clone(), tell.clone());
            let look = move |is_over: &dyn Fn() -> bool| {
                if nth < 4 {
                    ended.send(forever(is_over)).unwrap();
                }
                Ok(nth)
            };
            search.begin("a", look, move |found| tell.send(found.unwrap()).unwrap()).unwrap();
        }
        assert_eq!(told.recv_timeout(PATIENCE), Ok(4));
        drop((search, ended, tell));
        assert!(was_ended.iter().all(|was_ended| was_ended), "each that began was told to end");
        assert_eq!(told.iter().count(), 0);
    }

    #[test]
    fn a_search_ends_with_what_it_is_for_and_a_panic_of_one_harms_none() {
        let stop = Arc::new(AtomicBool::new(false));
        let search = OneSearch::new(stop.clone());
        let (tell, told) = channel();
        let hear = tell.clone();
        let fails = |_: &dyn Fn() -> bool| -> Result<bool> { panic!("a codec") };
        search.begin("a.zarr", fails, move |found| hear.send(found).unwrap()).unwrap();
        let error = told.recv_timeout(PATIENCE).unwrap().unwrap_err().to_string();
        assert!(error.starts_with("a.zarr: "), "{error}");
        let (ended, was_ended) = channel();
        let look = move |is_over: &dyn Fn() -> bool| {
            ended.send(forever(is_over)).unwrap();
            Ok(true)
        };
        search.begin("a.zarr", look, move |found| tell.send(found).unwrap()).unwrap();
        thread::sleep(Duration::from_millis(20));
        stop.store(true, Ordering::Relaxed);
        // Whether it had begun or not.
        assert_ne!(was_ended.recv_timeout(PATIENCE), Ok(false));
        assert!(told.recv_timeout(PATIENCE).is_err(), "nobody hears of it");
    }
}
