//! Images that nobody built: they are built into the cache when they are shown for the first time, and opened there; with
//! `--cache off` they are decoded into memory. Whoever shows something meanwhile is given a picture at once.

use std::cell::{Cell, RefCell};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use vastex::{AddressMode, TileSource};
use vastex_build::{
    BuildCache, BuildError, BuildOptions, CacheError, DecodeOptions, ImageHeader, InputFault, MemoryImage,
    Notice, Progress, WriteError,
};

use crate::meanwhile::{BuiltWith, Meanwhile};
use crate::{progress, report};

/// Texels along the longer side of a picture that is shown while its image is built: at least, where there is a quick way
/// to a smaller one, and at most, where it is made of the rows that the build reads.
const QUICK_SIDE: u32 = 1024;
const COARSE_SIDE: u32 = 2048;

/// The tiles of an image; nothing where the file is no image.
pub(crate) fn open(path: &Path, built: BuiltWith<'_>) -> Result<Option<Arc<dyn TileSource>>> {
    if built.cache.is_off() {
        return in_memory(path, built);
    }
    let directory = match &built.cache.cache {
        Some(directory) => directory.clone(),
        None => BuildCache::default_directory().with_context(|| {
            format!(
                "{}: has to be built before it can be shown, and there is no place for that ($XDG_CACHE_HOME and $HOME are not set); name one with --cache DIR",
                path.display()
            )
        })?,
    };
    let cache = BuildCache::new(directory, built.cache.cache_gib << 30);
    let x = if built.wraps { AddressMode::Wrap } else { AddressMode::Clamp };
    let options = BuildOptions { address: [x, AddressMode::Clamp], ..BuildOptions::default() };
    let watch = Watch::new(path, built, Some(cache.directory()));
    let opened = cache.open(path, &options, &watch);
    watch.bar.finish_and_clear();
    match opened {
        Ok(cached) => Ok(Some(Arc::new(cached.container))),
        Err(CacheError::Build(BuildError::Input { fault, .. })) if is_no_image(&fault) => Ok(None),
        Err(CacheError::Unusable { directory, error }) => bail!(
            "{}: cannot hold built images: {error}; name another directory with --cache DIR",
            directory.display()
        ),
        Err(CacheError::Build(BuildError::Output(WriteError::Io { error, .. }))) => bail!(
            "{}: cannot be built into {}: {error}; what is built so far is kept; name another directory with --cache DIR",
            path.display(),
            cache.directory().display()
        ),
        Err(error) => Err(error.into()),
    }
}

/// An image decoded into memory, at half of its size or less where all of it would take too much.
fn in_memory(path: &Path, built: BuiltWith<'_>) -> Result<Option<Arc<dyn TileSource>>> {
    let watch = Watch::new(path, built, None);
    let options = DecodeOptions { wraps: built.wraps, ..DecodeOptions::default() };
    let decoded = vastex_build::decode(path, &options, &watch, |image| {
        let size = image.image_size();
        if image.factor() > 1 {
            let (path, factor) = (path.display(), image.factor());
            let note = format!(
                "{path}: takes more than {} of memory at its full size, so it is shown at 1/{factor} of it; leave out `--cache off` to see all",
                report::bytes(options.limit)
            );
            watch.say(&format!("note: {note}"));
            built.meanwhile.note(&note);
        }
        if built.meanwhile.shows() && !watch.shows_quick(size) {
            built.meanwhile.show(image, size);
        }
    });
    watch.bar.finish_and_clear();
    match decoded {
        Ok(image) => Ok(Some(image)),
        Err(BuildError::Input { fault, .. }) if is_no_image(&fault) => Ok(None),
        Err(BuildError::Memory { path, needed, limit, .. }) => Err(anyhow!(
            "{}: its decoder takes {} of memory, and {} are allowed; leave out `--cache off`, or convert it to a TIFF of tiles",
            path.display(),
            report::bytes(needed),
            report::bytes(limit)
        )),
        Err(error) => Err(error.into()),
    }
}

/// Whether a file is something else than an image, about which others know more.
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

/// Says what takes its time, the first time only, and how far it is; and hands on what can be seen of it.
struct Watch<'a> {
    bar: indicatif::ProgressBar,
    /// Where it is built into, if it is.
    directory: Option<&'a Path>,
    path: &'a Path,
    wraps: bool,
    meanwhile: &'a dyn Meanwhile,
    is_said: Cell<bool>,
    is_waiting: Cell<bool>,
    /// What is made of the rows that are read.
    picture: RefCell<Picture>,
}

/// What is shown while an image is built.
enum Picture {
    /// Nothing yet.
    Unknown,
    /// Rows are added to it.
    Growing(Arc<MemoryImage>),
    /// It is all there, or there is none.
    Settled,
}

impl<'a> Watch<'a> {
    fn new(path: &'a Path, built: BuiltWith<'a>, directory: Option<&'a Path>) -> Watch<'a> {
        let BuiltWith { wraps, meanwhile, .. } = built;
        Watch {
            bar: progress::bar(false, "", "row"),
            directory,
            path,
            wraps,
            meanwhile,
            is_said: Cell::default(),
            is_waiting: Cell::default(),
            picture: RefCell::new(Picture::Unknown),
        }
    }

    fn say(&self, what: &str) {
        self.bar.suspend(|| report::say(what));
    }

    /// Shows a smaller picture, if there is a quick way to one. Whatever is wrong with the image is found again, and said,
    /// where all of it is read.
    fn shows_quick(&self, size: [u32; 2]) -> bool {
        let Ok(Some(reader)) = vastex_build::open_smaller(self.path, QUICK_SIDE) else { return false };
        let mut reader = vastex_build::in_srgb(reader);
        let header = reader.header().clone();
        let Ok(picture) = MemoryImage::new(&header, 1, self.wraps) else { return false };
        let mut rows = vec![0; header.row_bytes()];
        for _ in 0..header.height {
            if reader.read_rows(&mut rows).is_err() {
                return false;
            }
            picture.push(&rows);
        }
        self.meanwhile.show(&Arc::new(picture), size);
        true
    }

    /// A picture that grows with the rows of an image, or is all there; nothing where it is as quick to wait.
    fn begin(&self, header: &ImageHeader) -> Picture {
        let size = [header.width, header.height];
        let factor = MemoryImage::factor_of_side(header, COARSE_SIDE);
        if factor == 1 || self.shows_quick(size) {
            return Picture::Settled;
        }
        match MemoryImage::new(header, factor, self.wraps) {
            Ok(picture) => {
                let picture = Arc::new(picture);
                self.meanwhile.show(&picture, size);
                Picture::Growing(picture)
            }
            Err(_) => Picture::Settled,
        }
    }
}

impl Progress for Watch<'_> {
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()> {
        if let Some(directory) = self.directory.filter(|_| !self.is_said.replace(true)) {
            let (path, directory) = (self.path.display(), directory.display());
            self.say(&format!(
                "note: {path}: is built into {directory} once, and opens at once from then on"
            ));
        }
        self.bar.set_length(rows_total);
        self.bar.set_position(rows_done);
        if bytes_written > 0 {
            self.bar.set_message(format!(", {} written", report::bytes(bytes_written)));
        }
        self.meanwhile.advance(rows_done as f64 / rows_total.max(1) as f64)
    }

    fn wait(&self) -> ControlFlow<()> {
        if !self.is_waiting.replace(true) {
            self.say(&format!("note: {}: another program builds it; waiting", self.path.display()));
            if self.meanwhile.shows()
                && let Ok(reader) = vastex_build::open(self.path)
            {
                let header = reader.header();
                self.shows_quick([header.width, header.height]);
                self.picture.replace(Picture::Settled);
            }
        }
        self.meanwhile.advance(0.0)
    }

    fn rows(&self, image: &ImageHeader, rows: &[u8]) {
        if !self.meanwhile.shows() {
            return;
        }
        let mut picture = self.picture.borrow_mut();
        if matches!(*picture, Picture::Unknown) {
            *picture = self.begin(image);
        }
        if let Picture::Growing(picture) = &*picture {
            picture.push(rows);
        }
    }

    fn note(&self, image: &Path, notice: &Notice) {
        self.bar.suspend(|| report::say_of_image(image, notice));
    }
}
