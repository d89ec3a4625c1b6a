//! Images that nobody built: they are built into the cache when they are shown for the first time, and opened there.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use vastex::{AddressMode, TileSource};
use vastex_build::{
    BuildCache, BuildError, BuildOptions, CacheError, InputFault, Notice, Progress, WriteError,
};

use crate::args::CacheArgs;
use crate::{progress, report};

/// The container of an image; nothing where the file is no image. Its left and right edges are neighbours if `wraps`.
pub(crate) fn open(path: &Path, args: &CacheArgs, wraps: bool) -> Result<Option<Arc<dyn TileSource>>> {
    if args.is_off() {
        match vastex_build::open(path) {
            Ok(_) => bail!(
                "{}: has to be built before it can be shown; leave out `--cache off`, or build it: `vastex build {} -o OUT.vastex`",
                path.display(),
                path.display()
            ),
            Err(fault) if is_no_image(&fault) => return Ok(None),
            Err(fault) => return Err(fault).with_context(|| path.display().to_string()),
        }
    }
    let directory = match &args.cache {
        Some(directory) => directory.clone(),
        None => BuildCache::default_directory().with_context(|| {
            format!(
                "{}: has to be built before it can be shown, and there is no place for that ($XDG_CACHE_HOME and $HOME are not set); name one with --cache DIR",
                path.display()
            )
        })?,
    };
    let cache = BuildCache::new(directory, args.cache_gib << 30);
    let address = if wraps { [AddressMode::Wrap, AddressMode::Clamp] } else { [AddressMode::Clamp; 2] };
    let options = BuildOptions { address, ..BuildOptions::default() };
    let watch = Watch {
        bar: progress::bar(false, "", "row"),
        cache: &cache,
        path,
        is_said: Cell::default(),
        is_waiting: Cell::default(),
    };
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

/// Says what takes its time, the first time only, and how far it is.
struct Watch<'a> {
    bar: indicatif::ProgressBar,
    cache: &'a BuildCache,
    path: &'a Path,
    is_said: Cell<bool>,
    is_waiting: Cell<bool>,
}

impl Progress for Watch<'_> {
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()> {
        if !self.is_said.replace(true) {
            let (path, directory) = (self.path.display(), self.cache.directory().display());
            let said =
                format!("note: {path}: is built into {directory} once, and opens at once from then on");
            self.bar.suspend(|| report::say(&said));
        }
        self.bar.set_length(rows_total);
        self.bar.set_position(rows_done);
        self.bar.set_message(format!(", {} written", report::bytes(bytes_written)));
        ControlFlow::Continue(())
    }

    fn wait(&self) -> ControlFlow<()> {
        if !self.is_waiting.replace(true) {
            let said = format!("note: {}: another program builds it; waiting", self.path.display());
            self.bar.suspend(|| report::say(&said));
        }
        ControlFlow::Continue(())
    }

    fn note(&self, image: &Path, notice: &Notice) {
        self.bar.suspend(|| report::say_of_image(image, notice));
    }
}
