//! Pictures of the window that are being drawn, one after the other: each has a device, pools and sources of
//! its own, so several at once would take as much memory as several windows.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};

use super::clipboard::Copied;
use crate::output::{Output, free_name};
use crate::report;
use crate::screenshot::Patience;

/// Pictures that wait for others at most.
const MOST_WAITING: usize = 8;
/// How long the end of a program waits for pictures that were asked for; and for what was broken off then.
const LONGEST_END: Duration = Duration::from_secs(20);
const BREAKING_OFF: Duration = Duration::from_secs(1);
/// Between two looks at that.
const EVERY: Duration = Duration::from_millis(20);
/// An end that takes longer is told of.
const TOLD_AFTER: Duration = Duration::from_millis(300);

/// Draws a picture and writes it. Says if everything in view is there.
type Draw = Box<dyn FnOnce((&Output, &Patience)) -> Result<bool> + Send>;

/// A picture that is asked for.
pub(super) struct AskedShot {
    /// The file that it shows, after which it is named.
    pub(super) of: PathBuf,
    /// Where it is written.
    pub(super) directory: PathBuf,
    pub(super) draw: Draw,
    /// Is told what became of it, on another thread; then [`Shots::go_on`] is to be called.
    pub(super) send: Box<dyn FnOnce(Result<TakenShot>) + Send>,
}

/// A picture that lies in a file.
pub(super) struct TakenShot {
    pub(super) file: PathBuf,
    /// True if everything in view was loaded.
    pub(super) is_whole: bool,
}

/// Pictures that are being drawn; and what was copied.
#[derive(Default)]
pub(super) struct Shots {
    /// The next one first.
    waiting: VecDeque<AskedShot>,
    drawing: Option<Drawing>,
    pub(super) copied: Copied,
}

/// The picture that is being drawn.
struct Drawing {
    thread: JoinHandle<()>,
    patience: Arc<Patience>,
    place: Place,
}

/// Where a picture will be, while a file without bytes keeps its name for it.
type Place = Arc<Mutex<Option<Output>>>;

impl Shots {
    /// Has a picture drawn, after those that were asked for before: so many. Fails where too many wait.
    pub(super) fn ask(&mut self, asked: AskedShot) -> Result<usize> {
        if self.waiting.len() >= MOST_WAITING {
            bail!("{MOST_WAITING} pictures wait to be drawn; ask for others once these are there");
        }
        let before = self.waiting.len() + usize::from(self.drawing.is_some());
        self.waiting.push_back(asked);
        if self.drawing.is_none() {
            self.begin_next()?;
        }
        Ok(before)
    }

    /// The picture that was being drawn is there, or never will be: the next one is begun.
    pub(super) fn go_on(&mut self) -> Result<()> {
        if let Some(ended) = self.drawing.take() {
            // A panic was caught there.
            drop(ended.thread.join());
        }
        self.begin_next()
    }

    /// Begins the picture that has waited longest.
    fn begin_next(&mut self) -> Result<()> {
        let Some(AskedShot { of, directory, draw, send }) = self.waiting.pop_front() else { return Ok(()) };
        let (patience, place) = (Arc::<Patience>::default(), Place::default());
        let to = (patience.clone(), place.clone());
        let run = move || {
            let (patience, place) = to;
            let take = || take(&directory, &of, draw, (&patience, &place));
            let taken = catch_unwind(AssertUnwindSafe(take));
            let taken = taken.unwrap_or_else(|_| Err(anyhow!("a fault of this program")));
            // Nobody has any use for an empty file.
            discard(&place);
            send(taken.with_context(|| format!("no picture of {} was written", of.display())));
        };
        let thread = thread::Builder::new().name("vastex-shot".into()).spawn(run);
        let thread = thread.inspect_err(|_| self.waiting.clear()).context("no picture can be drawn")?;
        self.drawing = Some(Drawing { thread, patience, place });
        Ok(())
    }

    /// Waits a little for what was asked for, without building images for it. What is not there by then is
    /// broken off, and leaves no file.
    fn end(&mut self, longest: Duration) {
        let (begun, mut is_told) = (Instant::now(), false);
        while let Some(drawing) = &self.drawing {
            drawing.patience.shorten();
            if drawing.thread.is_finished() {
                drop(self.go_on());
                continue;
            }
            if begun.elapsed() >= longest {
                break;
            }
            if begun.elapsed() >= TOLD_AFTER && !std::mem::replace(&mut is_told, true) {
                let seconds = longest.as_secs();
                report::say(&format!("note: a picture is being drawn, and waited for {seconds} s at most"));
            }
            thread::sleep(EVERY);
        }
        let Some(Drawing { thread, patience, place }) = self.drawing.take() else { return };
        patience.end();
        while !thread.is_finished() && begun.elapsed() < longest + BREAKING_OFF {
            thread::sleep(EVERY);
        }
        // The thread ends with the program.
        discard(&place);
        let count = 1 + std::mem::take(&mut self.waiting).len();
        let pictures = if count == 1 { "picture was" } else { "pictures were" };
        report::say(&format!("error: {count} {pictures} not drawn before the window closed"));
    }
}

impl Drop for Shots {
    fn drop(&mut self) {
        self.end(LONGEST_END);
    }
}

/// Draws a picture into a new file of a directory.
fn take(
    directory: &Path,
    of: &Path,
    draw: impl FnOnce((&Output, &Patience)) -> Result<bool>,
    (patience, place): (&Patience, &Place),
) -> Result<TakenShot> {
    let file = free_name(directory, of, "png");
    let output = Output::at(&file)?;
    // The name is taken from now on.
    output.write(&[])?;
    *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(output.clone());
    let is_whole = draw((&output, patience))?;
    place.lock().unwrap_or_else(PoisonError::into_inner).take();
    Ok(TakenShot { file, is_whole })
}

/// Removes what was begun of a picture, if it has not been written.
fn discard(place: &Place) {
    let unfinished = place.lock().unwrap_or_else(PoisonError::into_inner).take();
    unfinished.iter().for_each(Output::discard);
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;

    const SOON: Duration = Duration::from_secs(60);

    /// Pictures that are drawn when the test says so, into a directory of its own.
    struct Asking {
        directory: tempfile::TempDir,
        shots: Shots,
        taken: (Sender<Result<TakenShot>>, Receiver<Result<TakenShot>>),
    }

    impl Asking {
        fn new() -> Asking {
            let directory = tempfile::tempdir().unwrap();
            Asking { directory, shots: Shots::default(), taken: channel() }
        }

        /// Asks for a picture; `draw` says what becomes of it.
        fn ask(
            &mut self,
            draw: impl FnOnce((&Output, &Patience)) -> Result<bool> + Send + 'static,
        ) -> Result<usize> {
            let send = self.taken.0.clone();
            let asked = AskedShot {
                of: "moon.tif".into(),
                directory: self.directory.path().to_owned(),
                draw: Box::new(draw),
                send: Box::new(move |taken| drop(send.send(taken))),
            };
            self.shots.ask(asked)
        }

        /// Waits for a picture, and begins the next one.
        fn taken(&mut self) -> Result<TakenShot> {
            let taken = self.taken.1.recv_timeout(SOON).unwrap();
            self.shots.go_on().unwrap();
            taken
        }

        fn files(&self) -> Vec<String> {
            let found = std::fs::read_dir(self.directory.path()).unwrap();
            let mut names: Vec<_> =
                found.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
            names.sort();
            names
        }
    }

    #[test]
    fn one_picture_is_drawn_at_a_time_and_few_wait() {
        let mut asking = Asking::new();
        let (begun, begins) = channel();
        let mut go_on = Vec::new();
        for n in 0..=MOST_WAITING {
            let (tell, told) = channel::<()>();
            go_on.push(tell);
            let begun = begun.clone();
            let draw = move |(output, _): (&Output, &Patience)| {
                begun.send(n).unwrap();
                told.recv_timeout(SOON).unwrap();
                output.write(b"a picture")?;
                // The second one lacks something.
                Ok(n != 1)
            };
            assert_eq!(asking.ask(draw).unwrap(), n);
        }
        let error = asking.ask(|_| panic!("it is one too many")).unwrap_err();
        assert!(error.to_string().contains("8 pictures wait"), "{error}");
        for (n, tell) in go_on.into_iter().enumerate() {
            assert_eq!(begins.recv_timeout(SOON), Ok(n));
            assert!(begins.recv_timeout(Duration::from_millis(2)).is_err(), "two are drawn at once");
            tell.send(()).unwrap();
            let TakenShot { file, is_whole } = asking.taken().unwrap();
            assert_eq!(file, asking.directory.path().join(format!("moon-{}.png", n + 1)));
            assert_eq!((is_whole, std::fs::read(&file).unwrap()), (n != 1, b"a picture".to_vec()));
        }
        assert!(asking.shots.drawing.is_none() && asking.files().len() == MOST_WAITING + 1);
    }

    #[test]
    fn what_fails_leaves_no_file_and_the_next_one_is_drawn() {
        let mut asking = Asking::new();
        let (tell, told) = channel::<()>();
        asking
            .ask(move |_| {
                told.recv_timeout(SOON).unwrap();
                bail!("the disk is full")
            })
            .unwrap();
        asking.ask(|_| panic!("a test of faults")).unwrap();
        asking.ask(|(output, _)| output.write(b"a picture").map(|()| true)).unwrap();
        tell.send(()).unwrap();
        let error = |taken: Result<TakenShot>| format!("{:#}", taken.map(|taken| taken.file).unwrap_err());
        let said = error(asking.taken());
        assert!(said.contains("moon.tif") && said.contains("the disk is full"), "{said}");
        let said = error(asking.taken());
        assert!(said.contains("a fault of this program"), "{said}");
        assert!(asking.taken().unwrap().is_whole);
        assert_eq!(asking.files(), ["moon-1.png"]);
    }

    /// The window may close at any time: what ends soon is waited for, what does not leaves nothing.
    #[test]
    fn at_the_end_pictures_are_waited_for_and_broken_off() {
        let mut asking = Asking::new();
        // Drawn before the end.
        asking.ask(|(output, _)| output.write(b"a picture").map(|()| true)).unwrap();
        asking.shots.end(SOON);
        assert_eq!(asking.files(), ["moon-1.png"]);
        // Broken off: it hears of it.
        asking
            .ask(|(_, patience)| {
                loop {
                    patience.check()?;
                    thread::sleep(Duration::from_millis(2));
                }
            })
            .unwrap();
        asking.ask(|_| panic!("nobody waits for it")).unwrap();
        asking.shots.end(Duration::from_millis(50));
        assert!(asking.shots.waiting.is_empty() && asking.shots.drawing.is_none());
        assert_eq!(asking.files(), ["moon-1.png"]);
        // It hears of nothing.
        let (tell, told) = channel::<()>();
        asking
            .ask(move |(output, _)| {
                let rows = output.png_rows([4, 4])?;
                told.recv_timeout(SOON).ok();
                drop(rows);
                Ok(true)
            })
            .unwrap();
        let begun = Instant::now();
        while asking.files().len() < 3 {
            assert!(begun.elapsed() < SOON, "it does not begin: {:?}", asking.files());
            thread::sleep(Duration::from_millis(2));
        }
        asking.shots.end(Duration::from_millis(50));
        assert_eq!(asking.files(), ["moon-1.png"]);
        drop(tell);
    }
}
