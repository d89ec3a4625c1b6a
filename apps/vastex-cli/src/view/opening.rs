//! A source on its way into the window: opened, and if need be built, on a thread of its own, so that the window never waits.
//!
//! What comes of it is told to the loop of events: perhaps a picture to look at meanwhile, how far the rest is, and the source itself or why
//! there is none. Who drops an [`Opening`] breaks it off and hears no more of it; what was built of an image stays in the cache.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result};
use vastex::{Prepared, Preparer, TextureSettings, TileSource};
use winit::event_loop::EventLoopProxy;

use crate::args::{SceneArgs, ViewArgs};
use crate::meanwhile::Meanwhile;
use crate::open;

/// Between two reports of how far it is.
const EVERY: Duration = Duration::from_millis(200);

/// What the thread says, of the opening with this number.
pub(super) struct News {
    pub(super) opening: u64,
    pub(super) told: Told,
}

/// What there is to say.
pub(super) enum Told {
    /// A picture to look at until the source is there.
    Coarse(Arrival),
    /// So much of it is done, 0 to 1.
    Done(f64),
    /// Something that a person should know.
    Note(String),
    /// The source.
    Whole(Arrival),
    Failed(Error),
}

/// A source that can be added to the textures.
pub(super) struct Arrival {
    pub(super) prepared: Prepared,
    /// Columns and rows of the image, whatever the source has of it.
    pub(super) size: [u32; 2],
    pub(super) rows: Rows,
}

/// Rows of a picture that grows.
pub(super) enum Rows {
    /// All of them are there.
    All,
    #[cfg(feature = "build")]
    Growing(Arc<vastex_build::MemoryImage>),
}

/// An opening that is under way.
pub(super) struct Opening {
    pub(super) number: u64,
    pub(super) path: PathBuf,
    is_dropped: Arc<AtomicBool>,
}

impl Drop for Opening {
    fn drop(&mut self) {
        self.is_dropped.store(true, Ordering::Relaxed);
    }
}

impl Opening {
    /// Begins to open a source as the arguments say; `number` tells its news from those of others.
    pub(super) fn begin(
        number: u64,
        path: PathBuf,
        args: Arc<ViewArgs>,
        preparer: Preparer,
        events: EventLoopProxy<News>,
    ) -> Result<Opening> {
        let is_dropped = Arc::new(AtomicBool::new(false));
        let opening = Opening { number, path: path.clone(), is_dropped: is_dropped.clone() };
        let reporter = Reporter { number, preparer, events, is_dropped, reported_at: Cell::default() };
        let open = move || {
            let told = match open_whole(&path, &args.scene, &reporter) {
                Ok(arrival) => Told::Whole(arrival),
                Err(error) => Told::Failed(error),
            };
            reporter.tell(told);
        };
        std::thread::Builder::new()
            .name("vastex-open".into())
            .spawn(open)
            .context("no thread can be started")?;
        Ok(opening)
    }
}

fn open_whole(path: &Path, args: &SceneArgs, reporter: &Reporter) -> Result<Arrival> {
    let tiles = open::open_another(path, args, reporter)?.tiles;
    let [width, height, _] = tiles.description().geometry.size();
    reporter.prepared(tiles, [width, height], Rows::All).with_context(|| path.display().to_string())
}

/// Tells the loop of events.
struct Reporter {
    number: u64,
    preparer: Preparer,
    events: EventLoopProxy<News>,
    is_dropped: Arc<AtomicBool>,
    reported_at: Cell<Option<Instant>>,
}

impl Reporter {
    fn tell(&self, told: Told) {
        // Nobody listens where the window is closed.
        let _ = self.events.send_event(News { opening: self.number, told });
    }

    fn prepared(&self, tiles: Arc<dyn TileSource>, size: [u32; 2], rows: Rows) -> Result<Arrival> {
        let prepared = self.preparer.read_blocking(tiles, TextureSettings::default())?;
        Ok(Arrival { prepared, size, rows })
    }
}

impl Meanwhile for Reporter {
    #[cfg(feature = "build")]
    fn show(&self, picture: &Arc<vastex_build::MemoryImage>, size: [u32; 2]) {
        let rows = if picture.is_whole() { Rows::All } else { Rows::Growing(picture.clone()) };
        if let Ok(arrival) = self.prepared(picture.clone(), size, rows) {
            self.tell(Told::Coarse(arrival));
        }
    }

    fn shows(&self) -> bool {
        true
    }

    fn advance(&self, share: f64) -> ControlFlow<()> {
        if self.is_dropped.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        let now = Instant::now();
        if self.reported_at.get().is_none_or(|before| now - before >= EVERY) {
            self.reported_at.set(Some(now));
            self.tell(Told::Done(share));
        }
        ControlFlow::Continue(())
    }

    fn note(&self, note: &str) {
        self.tell(Told::Note(note.to_owned()));
    }
}
