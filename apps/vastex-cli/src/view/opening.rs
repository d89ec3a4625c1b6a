//! Sources on their way into the window: opened, and if need be built, on threads of their own, so that the
//! window never waits.
//!
//! A thread reports what comes of its source: perhaps a preview, how far the rest is, and the source itself
//! or why there is none. One source is opened at a time; beginning another one breaks it off, and its late
//! reports are told from new ones by their number. What was built of an image stays in the cache.

#![cfg_attr(not(feature = "build"), allow(dead_code, reason = "nothing is built, so nothing is told of it"))]

use std::any::Any;
use std::cell::Cell;
#[cfg(feature = "volumes")]
use std::ffi::OsString;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
#[cfg(feature = "build")]
use std::sync::{Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, anyhow};
use vastex::{Preparer, TextureSettings, TileSource};
use vastex_scenes::SceneImage;
use vastex_viewer::panels::{FileAbout, Shapes};
use vastex_viewer::surface_scene::{Growth, PreparedSource};

use crate::args::ViewArgs;
use crate::commands::info::said_of;
#[cfg(feature = "volumes")]
use crate::commands::volume;
use crate::open::{self, Looked, OpenObserver};
#[cfg(feature = "build")]
use crate::open::{MendObserver, Mending, NoteObserver};
#[cfg(feature = "volumes")]
use crate::volumes::{Listed, OpenHow, OpenedVolume, open_volume, opens_as_volume};

/// Between two reports of how far it is; tests hear of every step.
const EVERY: Duration = Duration::from_millis(if cfg!(test) { 0 } else { 200 });
/// How long the end of a program waits for what is broken off: by then it has written down what is built.
const LONGEST_END: Duration = Duration::from_secs(2);

/// What a thread reports of the opening with this number.
pub(super) struct Report {
    pub(super) opening: u64,
    pub(super) event: OpeningEvent,
}

/// What comes of a source.
pub(super) enum OpeningEvent {
    /// A picture to look at until the source is there.
    Preview(PreparedSource),
    /// So much of it is done, 0 to 1.
    Progress(f64),
    /// Something that a person should know.
    Note(String),
    /// The same, found while its tiles are read.
    #[cfg(feature = "build")]
    LaterNote(String),
    /// What becomes of it where it lies in the cache and is damaged; it comes whenever that is found.
    #[cfg(feature = "build")]
    Mending(Mending),
    /// Shapes of another file that lie over it; they may come before the source, or after it.
    Shapes(Result<Arc<Shapes>>),
    /// The source.
    Opened(PreparedSource),
    /// It is a volume.
    #[cfg(feature = "volumes")]
    Volume(Box<ToShow>),
    /// It lists volumes, as a plate does.
    #[cfg(feature = "volumes")]
    Listed(Listed),
    Failed(Error),
}

/// A volume, with settings for its textures and what is said of it.
#[cfg(feature = "volumes")]
type ToShow = (OpenedVolume, vastex::Settings, SaidOfVolume);

/// What `vastex info` says of a volume, and what else its file can be opened as.
#[cfg(feature = "volumes")]
pub(super) type SaidOfVolume = (Arc<[(String, String)]>, Vec<(String, OsString)>);

/// The source that is being opened, and threads of those before it that have yet to end.
#[derive(Default)]
pub(super) struct Openings {
    current: Option<Opening>,
    begun: u64,
    ending: Vec<JoinHandle<()>>,
}

/// A source that is being opened.
pub(super) struct Opening {
    pub(super) number: u64,
    /// The number of the first opening of it: where a device was lost meanwhile, it is opened again, and is
    /// the same to a person.
    pub(super) first: u64,
    pub(super) path: PathBuf,
    is_broken_off: Arc<AtomicBool>,
    /// `None` if none could be started.
    thread: Option<JoinHandle<()>>,
}

impl Openings {
    /// Begins to open a source as the arguments say, perhaps with previews, and breaks off what was being
    /// opened, which may be the same one. The number of the opening.
    pub(super) fn begin(
        &mut self,
        (path, has_previews, is_again): (&Path, bool, bool),
        args: Arc<ViewArgs>,
        preparer: Preparer,
        send: impl Fn(Report) + Clone + Send + 'static,
    ) -> u64 {
        let before = self.current.as_ref().map(|opening| opening.first).filter(|_| is_again);
        self.break_off();
        self.begun += 1;
        let (number, is_broken_off) = (self.begun, Arc::new(AtomicBool::new(false)));
        let refuse = send.clone();
        // Previews are of files that lie over nothing.
        if let Some(shapes) = shapes_of((path, has_previews), &args) {
            let send = send.clone();
            let is_broken_off = is_broken_off.clone();
            let goes_on = move || !is_broken_off.load(Ordering::Relaxed);
            let send = move |event| send(Report { opening: number, event });
            if let Err(error) = read_shapes((path, shapes), goes_on, send.clone()) {
                send(OpeningEvent::Shapes(Err(error)));
            }
        }
        #[cfg(feature = "build")]
        let mending: MendObserver = {
            let send = Mutex::new(send.clone());
            Arc::new(move |mending| {
                let send = send.lock().unwrap_or_else(PoisonError::into_inner);
                send(Report { opening: number, event: OpeningEvent::Mending(mending) });
            })
        };
        #[cfg(feature = "build")]
        let later_notes: NoteObserver = {
            let send = Mutex::new(send.clone());
            Arc::new(move |note| {
                let send = send.lock().unwrap_or_else(PoisonError::into_inner);
                send(Report { opening: number, event: OpeningEvent::LaterNote(note.to_owned()) });
            })
        };
        let mut reporter = Reporter {
            #[cfg(feature = "build")]
            mending,
            #[cfg(feature = "build")]
            later_notes,
            about: FileAbout::default(),
            looked: Looked::default(),
            send: Box::new(move |event| send(Report { opening: number, event })),
            preparer,
            has_previews,
            is_broken_off: is_broken_off.clone(),
            reported_at: Cell::default(),
        };
        let to_open = path.to_owned();
        let open = move || {
            #[cfg(feature = "volumes")]
            if opens_as_volume(&to_open, &args) {
                let opened = catch_unwind(AssertUnwindSafe(|| open_volume_of(&to_open, &args)));
                return (reporter.send)(opened.unwrap_or_else(|panic| by_fault(&to_open, &*panic)));
            }
            let opened = catch_unwind(AssertUnwindSafe(|| {
                reporter.looked = Looked::at(&to_open);
                let said = said_of(&to_open, &reporter.looked).unwrap_or_default();
                reporter.about = open::file_about(&to_open, &reporter.looked, said);
                reporter.open(&to_open, &args)
            }));
            (reporter.send)(match opened {
                Ok(Ok(source)) => OpeningEvent::Opened(source),
                Ok(Err(error)) => OpeningEvent::Failed(error),
                Err(panic) => by_fault(&to_open, &*panic),
            });
        };
        let thread = thread::Builder::new().name("vastex-open".into()).spawn(open);
        // Another file may be opened later.
        let thread = thread.context("no thread can be started to open files").map_err(|error| {
            refuse(Report { opening: number, event: OpeningEvent::Failed(error) });
        });
        self.current = Some(Opening {
            number,
            first: before.unwrap_or(number),
            path: path.to_owned(),
            is_broken_off,
            thread: thread.ok(),
        });
        number
    }

    /// The source that is being opened, if it is the one with this number.
    pub(super) fn current(&self, number: u64) -> Option<&Opening> {
        self.current.as_ref().filter(|current| current.number == number)
    }

    /// Returns true if a source is being opened.
    pub(super) fn is_opening(&self) -> bool {
        self.current.is_some()
    }

    /// The number of the first opening of the source that is being opened.
    pub(super) fn first(&self) -> Option<u64> {
        self.current.as_ref().map(|current| current.first)
    }

    /// The number of the opening of the source that is being opened.
    pub(super) fn number(&self) -> Option<u64> {
        self.current.as_ref().map(|current| current.number)
    }

    /// The source is there, or there will be none.
    pub(super) fn end(&mut self) {
        self.ending.retain(|thread| !thread.is_finished());
        self.ending.extend(self.current.take().and_then(|ended| ended.thread));
    }

    fn break_off(&mut self) {
        if let Some(current) = &self.current {
            current.is_broken_off.store(true, Ordering::Relaxed);
        }
        self.end();
    }
}

impl Drop for Openings {
    /// Breaks off what is being opened, and waits a little for it.
    fn drop(&mut self) {
        self.break_off();
        let begun = Instant::now();
        while self.ending.iter().any(|thread| !thread.is_finished()) && begun.elapsed() < LONGEST_END {
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// The file of shapes over a source, which lies over nothing or over another one: shapes are of the lowest,
/// also where other bands of the same file lie over it.
fn shapes_of((path, is_lowest): (&Path, bool), args: &ViewArgs) -> Option<PathBuf> {
    args.shapes.clone().filter(|_| is_lowest && open::is_same_file(path, &args.scene.source))
}

/// Reads the shapes that lie over a source on a thread of their own: no picture waits for them.
fn read_shapes(
    (source, path): (&Path, PathBuf),
    goes_on: impl Fn() -> bool + Send + 'static,
    send: impl Fn(OpeningEvent) + Send + 'static,
) -> Result<()> {
    let source = source.to_owned();
    let read = move || {
        let shapes = catch_unwind(AssertUnwindSafe(|| open::shapes_over(&source, &path, &goes_on)));
        if !goes_on() {
            return;
        }
        let shapes = shapes.unwrap_or_else(|panic| {
            let (path, why) = (path.display(), text_of(&*panic));
            Err(anyhow!("{path}: cannot be read, by a fault of this program: {why}"))
        });
        send(OpeningEvent::Shapes(shapes.map(Arc::new)));
    };
    let thread = thread::Builder::new().name("vastex-shapes".into()).spawn(read);
    thread.map(drop).context("no thread can be started to read shapes")
}

/// Whether the command line names a file, or a plate that it is an image of.
#[cfg(feature = "volumes")]
fn is_named(path: &Path, args: &ViewArgs) -> bool {
    let mut named = std::iter::once(&args.scene.source).chain(&args.files);
    named.any(|named| open::is_same_file(path, named) || path.starts_with(named))
}

/// A volume, or why there is none.
#[cfg(feature = "volumes")]
fn open_volume_of(path: &Path, args: &ViewArgs) -> OpeningEvent {
    let how = OpenHow::of(args).live().of_named(is_named(path, args));
    let opened = open_volume(path, how).and_then(|opened| {
        let settings = opened.settings(&args.scene)?;
        let rows = volume::rows(&opened.volume).unwrap_or_default();
        Ok(Box::new((opened, settings, (rows.into(), open::images_of_volume(path)))))
    });
    match opened {
        Ok(opened) => OpeningEvent::Volume(opened),
        Err(error) => error.downcast().map_or_else(OpeningEvent::Failed, OpeningEvent::Listed),
    }
}

fn by_fault(path: &Path, panic: &(dyn Any + Send)) -> OpeningEvent {
    let (path, why) = (path.display(), text_of(panic));
    OpeningEvent::Failed(anyhow!("{path}: cannot be opened, by a fault of this program: {why}"))
}

/// What a panic was given to say.
fn text_of(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("unknown")
}

/// Opens a source and reports on it.
struct Reporter {
    #[cfg(feature = "build")]
    mending: MendObserver,
    #[cfg(feature = "build")]
    later_notes: NoteObserver,
    send: Box<dyn Fn(OpeningEvent) + Send>,
    preparer: Preparer,
    about: FileAbout,
    /// What was found at its path.
    looked: Looked,
    has_previews: bool,
    is_broken_off: Arc<AtomicBool>,
    reported_at: Cell<Option<Instant>>,
}

impl Reporter {
    fn open(&self, path: &Path, args: &ViewArgs) -> Result<PreparedSource> {
        let SceneImage { tiles, size } = open::open_another(path, &args.scene, self)?.image;
        self.prepare(tiles, size, Growth::Whole).with_context(|| path.display().to_string())
    }

    fn prepare(&self, tiles: Arc<dyn TileSource>, size: [u32; 2], growth: Growth) -> Result<PreparedSource> {
        let prepared = self.preparer.read_blocking(tiles.clone(), TextureSettings::default())?;
        Ok(PreparedSource { prepared, tiles, size, about: self.about.clone(), growth })
    }
}

impl OpenObserver for Reporter {
    fn is_watched(&self) -> bool {
        true
    }

    fn looked(&self) -> Option<&Looked> {
        Some(&self.looked)
    }

    fn wants_preview(&self) -> bool {
        self.has_previews
    }

    #[cfg(feature = "build")]
    fn preview(&self, picture: &Arc<vastex_build::MemoryImage>, size: [u32; 2]) {
        let growing = picture.clone();
        let growth = match picture.is_whole() {
            true => Growth::Whole,
            false => Growth::Rows(Arc::new(move || growing.rows())),
        };
        if let Ok(preview) = self.prepare(picture.clone(), size, growth) {
            (self.send)(OpeningEvent::Preview(preview));
        }
    }

    fn advance(&self, share: f64) -> ControlFlow<()> {
        if self.is_broken_off.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        let now = Instant::now();
        if self.reported_at.get().is_none_or(|before| now - before >= EVERY) {
            self.reported_at.set(Some(now));
            (self.send)(OpeningEvent::Progress(share));
        }
        ControlFlow::Continue(())
    }

    fn reduced(&self, _: [u32; 2], note: &str) {
        self.note(note);
    }

    fn note(&self, note: &str) {
        (self.send)(OpeningEvent::Note(note.to_owned()));
    }

    #[cfg(feature = "build")]
    fn mending(&self) -> Option<MendObserver> {
        Some(self.mending.clone())
    }

    #[cfg(feature = "build")]
    fn later_notes(&self) -> Option<NoteObserver> {
        Some(self.later_notes.clone())
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::args::{Args, Command};

    #[test]
    fn shapes_are_of_the_lowest_file_and_of_no_bands_over_it() {
        let words = ["vastex", "view", "--shapes", "a.geojson", "a.tif"];
        let Command::View(args) = Args::parse_from(words).command else { panic!() };
        let has_shapes = |path: &str, is_lowest| shapes_of((Path::new(path), is_lowest), &args).is_some();
        assert!(has_shapes("a.tif", true) && has_shapes("./a.tif", true));
        assert!(!has_shapes("a.tif", false) && !has_shapes("b.tif", true));
    }

    /// What was built by then is taken over when the image is opened again.
    #[cfg(feature = "build")]
    #[test]
    fn a_window_that_closes_while_an_image_is_built_loses_nothing_of_it() {
        let directory = tempfile::tempdir().unwrap();
        let (image, cache) = (directory.path().join("a.png"), directory.path().join("cache"));
        let side = 1400;
        let noise = |n: u32| (n ^ (n >> 7)).wrapping_mul(0x9e37_79b9).to_le_bytes()[3];
        let texels: Vec<u8> = (0..side * side * 4).map(noise).collect();
        let mut encoder = png::Encoder::new(std::fs::File::create(&image).unwrap(), side, side);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_compression(png::Compression::NoCompression);
        encoder.write_header().unwrap().write_image_data(&texels).unwrap();
        let line = ["vastex", "view", "--cache", cache.to_str().unwrap(), image.to_str().unwrap()];
        let Command::View(args) = Args::parse_from(line).command else { panic!() };
        let gpu = vastex_scenes::headless_gpu().unwrap();
        let textures = vastex::Textures::new(&gpu.device, &gpu.queue, vastex::Settings::default()).unwrap();
        let is_far = |event: &OpeningEvent| match event {
            OpeningEvent::Progress(share) => *share > 0.5,
            OpeningEvent::Opened(_) => panic!("it was built before it was broken off"),
            OpeningEvent::Failed(error) => panic!("{error:#}"),
            _ => false,
        };
        let (send, events) = std::sync::mpsc::channel();
        let mut openings = Openings::default();
        // The build goes on once it is told that it is broken off.
        let is_told = Arc::new(std::sync::Barrier::new(2));
        let waits = is_told.clone();
        openings.begin((&image, true, false), Arc::new(*args), textures.preparer(), move |report: Report| {
            let waits_now = matches!(report.event, OpeningEvent::Progress(share) if share > 0.5);
            let _ = send.send(report.event);
            if waits_now {
                waits.wait();
            }
        });
        let patience = Duration::from_secs(300);
        while !is_far(&events.recv_timeout(patience).unwrap()) {}
        openings.break_off();
        is_told.wait();
        drop(openings);
        let cache = vastex_build::BuildCache::new(cache, 1 << 30);
        let built = cache.open(&image, &vastex_build::BuildOptions::default(), &()).unwrap().built;
        assert!(built.unwrap().resumed_tiles > 0);
    }
}
