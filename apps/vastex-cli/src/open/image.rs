//! Images that nobody built: they are built into the cache when they are shown for the first time, and opened
//! there; with `--cache off` they are decoded into memory.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, anyhow};
use vastex::{AddressMode, TileSource};
use vastex_build::{
    BuildCache, BuildError, BuildOptions, CacheError, DecodeOptions, Decoding, ImageHeader, InputFault,
    MemoryImage, Notice, Progress, TiffDirectories, WriteError,
};

use super::OpenImage;
use super::mended::{Anew, Mended};
use super::observer::OpenObserver;
use super::preview::Preview;
use crate::{progress, report};

/// Texels along the longer side of an image that is shown at a share of its size for want of memory, at
/// least, and rows of it that are read at once.
const SHARE_SIDE: u32 = 512;
const SHARE_ROWS: u32 = 64;
/// Bytes of an image that is turned at a share of its size, at most.
const SHARE_BYTES: u64 = 256 << 20;

/// How often another program is waited for, a tenth of a second each, before that is said.
const WAITS_BEFORE_NOTE: u32 = 5;

/// A cache that cannot hold what is built; the text names it and what to do, but for doing without a cache.
#[derive(Debug)]
pub(super) struct CacheFault {
    text: String,
    /// True if something of the image is shown, and stays.
    is_seen: bool,
}

impl fmt::Display for CacheFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, or do without by --cache off", self.text)
    }
}

impl std::error::Error for CacheFault {}

/// The tiles of an image; `None` if the file is no image.
pub(super) fn open(path: &Path, options: OpenImage<'_>) -> Result<Option<Arc<dyn TileSource>>> {
    if options.cache.is_off() { decoded(path, options, false) } else { cached(path, options) }
}

/// What was opened, or, of an image that cannot be kept, the image decoded into memory as by `--cache off`,
/// with a note that says so. Where that cannot be either, the error is what is wrong with the image, or why
/// its decoder cannot read it, after why it cannot be kept.
pub(super) fn without_cache(
    path: &Path,
    options: Option<OpenImage<'_>>,
    built: Result<Option<Arc<dyn TileSource>>>,
) -> Result<Option<Arc<dyn TileSource>>> {
    let fault = match built {
        Ok(tiles) => return Ok(tiles),
        Err(error) => error.downcast::<CacheFault>()?,
    };
    let Some(options) = options else { return Err(fault.into()) };
    let note = format!("{}; decoding it into memory instead", fault.text);
    report::say(&format!("note: {note}"));
    options.observer.note(&note);
    match decoded(path, options, fault.is_seen) {
        Ok(Some(tiles)) => Ok(Some(tiles)),
        Err(error) if super::is_of_image(&error) => Err(error),
        Ok(None) => Err(fault.into()),
        // `--cache off` is no remedy: it would decode into memory, too.
        Err(error) => Err(error.context(fault.text)),
    }
}

/// An image's container in the cache, which is built if it is not there.
fn cached(path: &Path, options: OpenImage<'_>) -> Result<Option<Arc<dyn TileSource>>> {
    let directory = match &options.cache.cache {
        Some(directory) => directory.clone(),
        None => BuildCache::default_directory().ok_or_else(|| CacheFault {
            text: format!(
                "{}: has to be built before it can be shown, and there is no place for that ($XDG_CACHE_HOME and $HOME are not set); name one with --cache DIR",
                path.display()
            ),
            is_seen: false,
        })?,
    };
    let cache = BuildCache::new(directory, options.cache.cache_gib << 30);
    let x = if options.wraps { AddressMode::Wrap } else { AddressMode::Clamp };
    let gives_way = options.observer.is_watched();
    let build = BuildOptions { address: [x, AddressMode::Clamp], gives_way, ..BuildOptions::default() };
    let progress = ImageProgress::new(path, options, Some(cache.directory()));
    let opened = cache.open(path, &build, &progress);
    progress.bar.finish_and_clear();
    let fault = |text| Err(CacheFault { text, is_seen: progress.preview.borrow().is_seen() }.into());
    match opened {
        Ok(cached) => {
            let anew = Anew { cache, image: path.to_owned(), options: build };
            Ok(Some(Arc::new(Mended::new(cached.container, anew, options.observer.mending()))))
        }
        Err(CacheError::Build(BuildError::Input { fault, .. })) if is_no_image(&fault) => Ok(None),
        Err(CacheError::Build(BuildError::Memory { path, needed, limit, remedy }))
            if options.observer.is_watched() =>
        {
            let scaled = at_a_share(&path, &progress, [needed, limit], options.wraps);
            let error = BuildError::Memory { path, needed, limit, remedy };
            scaled.map(|image| Some(image as Arc<dyn TileSource>)).ok_or_else(|| error.into())
        }
        Err(CacheError::Unusable { directory, error }) => fault(format!(
            "{}: cannot hold built images: {error}; name another directory with --cache DIR",
            directory.display()
        )),
        Err(CacheError::Build(BuildError::Output(WriteError::Io { error, .. }))) => fault(format!(
            "{}: cannot be built into {}: {error}; what is built so far is kept; name another directory with --cache DIR",
            path.display(),
            cache.directory().display()
        )),
        Err(error) => Err(error.into()),
    }
}

/// An image decoded into memory, at half of its size or less where all of it would take too much. What is
/// seen of it already stays until then.
fn decoded(path: &Path, options: OpenImage<'_>, is_seen: bool) -> Result<Option<Arc<dyn TileSource>>> {
    let progress = ImageProgress::new(path, options, None);
    if is_seen {
        progress.preview.borrow_mut().leave();
    }
    let gives_way = options.observer.is_watched();
    let decode = DecodeOptions { wraps: options.wraps, gives_way, ..DecodeOptions::default() };
    let decoded = Decoding::open_while(path, &decode, &progress).and_then(|decoding| {
        progress.note_reduced(decoding.image(), decode.image_bytes);
        progress.preview.borrow_mut().take(decoding.image().clone());
        decoding.run(&progress)
    });
    progress.bar.finish_and_clear();
    match decoded {
        Ok(image) => Ok(Some(image)),
        Err(BuildError::Input { fault, .. }) if is_no_image(&fault) => Ok(None),
        Err(BuildError::Memory { path, needed, limit, .. }) => {
            match at_a_share(&path, &progress, [needed, limit], options.wraps) {
                Some(image) => Ok(Some(image)),
                None => Err(anyhow!(
                    "{}: its decoder takes {} of memory, and {} are allowed; {}{}",
                    path.display(),
                    report::bytes(needed),
                    report::bytes(limit),
                    if options.cache.is_off() { "leave out `--cache off`, or " } else { "" },
                    match is_tiled(&path) {
                        true => "add coarser levels to it (`gdaladdo FILE`)",
                        false => "convert it to a TIFF of tiles",
                    }
                )),
            }
        }
        Err(error) => Err(error.into()),
    }
}

/// Returns true if a path is that of a TIFF file of tiles.
fn is_tiled(path: &Path) -> bool {
    TiffDirectories::read(path).is_ok_and(|tiff| tiff.is_tiled())
}

/// An image at the share of its size that is read without the memory that all of it needs, with a note that
/// says so; `None` where there is none and where it is damaged. Of a TIFF file of tiles none that is quick is
/// taken: that has the texels of a few of them. Of two numbers of bytes the first is what all of it needs,
/// and the second what is allowed.
fn at_a_share(
    path: &Path,
    progress: &ImageProgress<'_>,
    [needed, limit]: [u64; 2],
    wraps: bool,
) -> Option<Arc<MemoryImage>> {
    let quick = match is_tiled(path) {
        true => None,
        false => vastex_build::open_reduced(path, SHARE_SIDE).ok()?,
    };
    let reduced = match quick {
        Some(quick) => quick,
        None => {
            vastex_build::open_shrunk(path, SHARE_BYTES, DecodeOptions::default().reader_bytes).ok()??
        }
    };
    let whole = vastex_build::open(path).ok()?.header().clone();
    let mut reader = vastex_build::in_srgb(reduced);
    let header = reader.header().clone();
    let halvings = MemoryImage::halvings_to_fit(&header, DecodeOptions::default().image_bytes);
    let image = MemoryImage::new(&header, halvings, wraps).ok()?;
    let mut rows = vec![0; SHARE_ROWS as usize * header.row_bytes()];
    let advance = |first: u32| {
        let (before, share) = (progress.before_rows.get(), f64::from(first) / f64::from(header.height));
        progress.observer.advance(before + (1.0 - before) * share)
    };
    for first in (0..header.height).step_by(SHARE_ROWS as usize) {
        let rows = &mut rows[..SHARE_ROWS.min(header.height - first) as usize * header.row_bytes()];
        match first {
            0 => vastex_build::read_first_rows(&mut *reader, rows, progress)?.ok()?,
            _ => vastex_build::read_further_rows(&mut *reader, rows, &|| advance(first))?.ok()?,
        }
        image.push(rows);
        if advance(first).is_break() {
            return None;
        }
    }
    let [needed, limit] = [needed, limit].map(report::bytes);
    let share = u64::from(whole.width.div_ceil(header.width)) << halvings;
    let note = format!(
        "{}: its decoder takes {needed} of memory, and {limit} are allowed, so it is shown at 1/{share} of its size; convert it to a TIFF of tiles to see all of it",
        path.display()
    );
    progress.say(&format!("note: {note}"));
    progress.observer.reduced([whole.width, whole.height], &note);
    Some(Arc::new(image))
}

/// Returns true if a file is something else than an image, about which others know more.
pub(crate) fn is_no_image(fault: &InputFault) -> bool {
    matches!(
        fault,
        InputFault::Text
            | InputFault::UnknownFormat(_)
            | InputFault::Empty
            | InputFault::Container
            | InputFault::Part
            | InputFault::Directory
            | InputFault::NotAFile
    )
}

/// Says what takes its time, the first time only, and how far it is; and hands rows on to the preview.
struct ImageProgress<'a> {
    bar: indicatif::ProgressBar,
    /// Where it is built into, if it is.
    directory: Option<&'a Path>,
    path: &'a Path,
    observer: &'a dyn OpenObserver,
    /// True if nothing is to be kept.
    is_off: bool,
    is_said: Cell<bool>,
    gives_way: Cell<bool>,
    waits: Cell<u32>,
    /// Share of all that is done before the first row is there.
    before_rows: Cell<f64>,
    preview: RefCell<Preview<'a>>,
}

impl<'a> ImageProgress<'a> {
    fn new(path: &'a Path, options: OpenImage<'a>, directory: Option<&'a Path>) -> ImageProgress<'a> {
        let OpenImage { wraps, observer, .. } = options;
        ImageProgress {
            bar: progress::bar(false, "", "row"),
            directory,
            path,
            observer,
            is_off: options.cache.is_off(),
            is_said: Cell::default(),
            gives_way: Cell::default(),
            waits: Cell::default(),
            before_rows: Cell::default(),
            preview: RefCell::new(Preview::new(path, wraps, observer)),
        }
    }

    fn say(&self, what: &str) {
        self.bar.suspend(|| report::say(what));
    }

    /// Says of an image that was too large for memory how large it is shown.
    fn note_reduced(&self, image: &MemoryImage, limit: u64) {
        if image.halvings() == 0 {
            return;
        }
        let (path, limit) = (self.path.display(), report::bytes(limit));
        let share = 1u64 << image.halvings();
        let remedy = match self.is_off {
            true => "leave out `--cache off`",
            false => "name a directory that can hold it with --cache DIR",
        };
        let note = format!(
            "{path}: would take more than {limit} of memory, so it is shown at 1/{share} of its size; {remedy} to see all of it"
        );
        self.say(&format!("note: {note}"));
        self.observer.reduced(image.image_size(), &note);
    }
}

impl Progress for ImageProgress<'_> {
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()> {
        if let Some(directory) = self.directory.filter(|_| !self.is_said.replace(true)) {
            let (path, directory) = (self.path.display(), directory.display());
            self.say(&format!(
                "note: {path}: is built into {directory} once, and opens at once from then on"
            ));
        }
        self.preview.borrow_mut().begin();
        // A quick preview is there: from now on the picture comes before the rest of the image.
        if self.observer.is_watched() && !self.gives_way.replace(true) {
            vastex_build::give_way();
        }
        self.bar.set_length(rows_total);
        self.bar.set_position(rows_done);
        if bytes_written > 0 {
            self.bar.set_message(format!(", {} written", report::bytes(bytes_written)));
        }
        let (before, share) = (self.before_rows.get(), rows_done as f64 / rows_total.max(1) as f64);
        self.observer.advance(before + (1.0 - before) * share)
    }

    fn opening(&self) -> ControlFlow<()> {
        self.observer.advance(0.0)
    }

    fn beginning(&self, share: f64) -> ControlFlow<()> {
        // About as long as the rest takes.
        self.before_rows.set(0.5);
        self.bar.set_message(format!(", {} decoded", report::percent(share)));
        self.observer.advance(0.5 * share)
    }

    fn wait(&self) -> ControlFlow<()> {
        // One that is broken off gives its place up in a moment.
        self.waits.set(self.waits.get().saturating_add(1));
        if self.waits.get() == WAITS_BEFORE_NOTE {
            self.say(&format!("note: {}: another program builds it; waiting", self.path.display()));
        }
        self.preview.borrow_mut().read_on();
        self.observer.advance(0.0)
    }

    fn rows(&self, image: &ImageHeader, first: u32, rows: &[u8]) {
        self.preview.borrow_mut().add(image, first, rows);
    }

    fn note(&self, image: &Path, notice: &Notice) {
        self.bar.suspend(|| report::say_of_image(image, notice));
        self.observer.note(&format!("{}: {notice}", image.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::CacheArgs;
    use crate::open::observer::Measured;
    use crate::open::tests::tiled_tiff;

    /// What is seen of a few tiles is a first picture, and not what stands for the image.
    #[test]
    fn an_image_of_tiles_is_not_shown_at_a_share_for_good() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("tiles.tif");
        std::fs::write(&path, tiled_tiff(64, 64)).unwrap();
        assert!(vastex_build::open_reduced(&path, SHARE_SIDE).unwrap().is_some());
        let cache = CacheArgs { cache: Some("off".into()), cache_gib: 1 };
        let progress =
            ImageProgress::new(&path, OpenImage { cache: &cache, wraps: false, observer: &() }, None);
        assert!(at_a_share(&path, &progress, [2, 1], false).is_none());
    }

    /// What takes its memory to be turned is turned at a share of its size.
    #[test]
    fn an_image_that_is_stored_turned_is_shown_at_a_share() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("turned.tif");
        let mut file = tiled_tiff(2, 2);
        // Instead of how many samples a texel has, one in any case, how the image is stored.
        let at = file.windows(2).position(|tag| tag == 277u16.to_le_bytes()).unwrap();
        file[at..at + 12].copy_from_slice(&[18, 1, 3, 0, 1, 0, 0, 0, 6, 0, 0, 0]);
        std::fs::write(&path, file).unwrap();
        let cache = CacheArgs { cache: Some("off".into()), cache_gib: 1 };
        let measured = Measured::new(&());
        let progress =
            ImageProgress::new(&path, OpenImage { cache: &cache, wraps: false, observer: &measured }, None);
        let image = at_a_share(&path, &progress, [2, 1], false).unwrap();
        assert_eq!(image.image_size(), [512, 512]);
        assert_eq!(measured.image([1, 1]), [512, 512], "whatever there is of it");
        // Nothing of it is there before it has been read: that is told of, and broken off.
        let impatient = Impatient::default();
        let progress =
            ImageProgress::new(&path, OpenImage { cache: &cache, wraps: false, observer: &impatient }, None);
        assert!(at_a_share(&path, &progress, [2, 1], false).is_none());
        assert_eq!(impatient.told.get(), 1, "it is not read on");
    }

    /// Breaks off what it is told of.
    #[derive(Default)]
    struct Impatient {
        told: Cell<u32>,
    }

    impl OpenObserver for Impatient {
        fn advance(&self, _: f64) -> ControlFlow<()> {
            self.told.set(self.told.get() + 1);
            ControlFlow::Break(())
        }
    }
}
