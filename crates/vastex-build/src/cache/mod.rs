//! Containers of images that nobody built, kept in a directory, so that an image is built once and opens at
//! once from then on. Nothing is written beside the image.
//!
//! The contract:
//!
//! - **The image as it is now.** A container belongs to the image's files: their places, lengths and times
//!   and a sample of their bytes (of the first 64 files the first and the last MiB, too), with the build's
//!   options and the version of Vastex. An image that changes while it is built is an error, and nothing of
//!   it stays.
//! - **Nothing is lost.** What an interrupted build made stays, and the next one goes on with it; so it does
//!   after a crash. Only a fault of the image itself ends that.
//! - **Several programs** may share the directory. A lock for each image keeps them apart, `.KEY.lock`: who
//!   has it builds, and whoever else wants the image waits. What a lock protects nobody else removes; one
//!   that nobody holds goes when room is made. On a file system without locks two programs may build one
//!   image twice, and nothing unfinished is ever removed.
//! - **The budget** bounds the containers and the unfinished builds together, before and after each build,
//!   but for the container that is opened, which may be larger: those that were not opened for longest go. On
//!   a full disk all others go. A program that has one open goes on reading it.
//!
//! How a container is built is `build`'s business; which files are images, `image`'s.

mod key;
mod room;

use std::fs::{File, FileTimes};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use vastex_tiles::{Container, ContainerError, WriteError};

use crate::build::{self, BuildError, BuildOptions, BuildReport, OpenLayer, Stage};
use crate::image::InputFault;
use crate::progress::Progress;
use room::Lock;

/// How often a program looks whether another one has built what it waits for.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// Why an image has no container in a cache.
#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    /// The image cannot be built, or its container cannot be written.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The directory cannot be made, or a file in it cannot be read.
    #[error("{directory}: cannot hold built images: {error}; name another directory", directory = directory.display())]
    Unusable {
        /// The directory.
        directory: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The container in the directory cannot be read.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// The image was changed while it was built.
    #[error("{}: was changed while it was read; try again once it is whole", .0.display())]
    Changed(PathBuf),
}

/// What a cache has of an image.
#[derive(Debug)]
pub struct CachedImage {
    /// The image's container in the cache.
    pub container: Container,
    /// How the container was built, if it was not in the cache.
    pub built: Option<BuildReport>,
}

/// A directory of containers that were built of images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildCache {
    directory: PathBuf,
    budget: u64,
}

impl BuildCache {
    /// Bytes that a cache has where nobody says otherwise: 20 GiB.
    pub const DEFAULT_BUDGET: u64 = 20 << 30;

    /// In a directory, which is made when something is built, with `budget` bytes.
    pub fn new(directory: impl Into<PathBuf>, budget: u64) -> BuildCache {
        BuildCache { directory: directory.into(), budget }
    }

    /// The directory that the system's rules give to Vastex: `vastex` in `$XDG_CACHE_HOME`, in
    /// `%LOCALAPPDATA%` on Windows, or else in `~/.cache`; in `~/Library/Caches` on Apple's systems. `None`
    /// if neither is set to an absolute path.
    pub fn default_directory() -> Option<PathBuf> {
        let named = |variable: &str| {
            std::env::var_os(variable).map(PathBuf::from).filter(|directory| directory.is_absolute())
        };
        let of_home = if cfg!(target_vendor = "apple") { "Library/Caches" } else { ".cache" };
        let of_system = if cfg!(windows) { named("LOCALAPPDATA") } else { None };
        let caches = named("XDG_CACHE_HOME").or(of_system);
        let caches = caches.or_else(|| Some(named("HOME")?.join(of_home)))?;
        Some(caches.join("vastex"))
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The container of an image, which is built if it is not there.
    ///
    /// `options` decide what is built; their `resume` and `durable` are always on, `part`, `keep_levels` and
    /// `insets` are not heeded. `progress` hears of the build as from [`crate::build()`], and may stop it:
    /// what is built stays. Where the container is there, this opens the image, reads a sample of it (2 MiB
    /// of each of its first 64 files, less of each other one), and the container's index. Fails where
    /// [`crate::build()`] would.
    pub fn open(
        &self,
        image: &Path,
        options: &BuildOptions,
        progress: &dyn Progress,
    ) -> Result<CachedImage, CacheError> {
        let options = built_with(options);
        let named = self.key(image, &options, progress)?;
        if let Some(container) = whole(&self.directory.join(&named.0))? {
            return Ok(CachedImage { container, built: None });
        }
        self.open_alone(image, named, &options, &|_| true, progress)
    }

    /// The container of an image in the place of one that turned out to be damaged.
    ///
    /// No other program builds or removes it meanwhile: this waits for the right to do so, as
    /// [`BuildCache::open`] does. If another program has built it anew by then, which `is_sound` finds out,
    /// that container is opened; else it is removed, and built anew. Fails as [`BuildCache::open`] does.
    pub fn open_sound(
        &self,
        image: &Path,
        options: &BuildOptions,
        is_sound: &dyn Fn(&Container) -> bool,
        progress: &dyn Progress,
    ) -> Result<CachedImage, CacheError> {
        let options = built_with(options);
        let named = self.key(image, &options, progress)?;
        self.open_alone(image, named, &options, is_sound, progress)
    }

    /// The container of an image, by its name, once no other program has the right to build it.
    fn open_alone(
        &self,
        image: &Path,
        (name, layers): (String, Vec<OpenLayer>),
        options: &BuildOptions,
        is_sound: &dyn Fn(&Container) -> bool,
        progress: &dyn Progress,
    ) -> Result<CachedImage, CacheError> {
        let place = self.directory.join(&name);
        std::fs::create_dir_all(&self.directory).map_err(self.unusable())?;
        let lock = self.lock(&name, progress)?;
        // Another program may have built it meanwhile.
        let (container, built) = match whole(&place)?.filter(is_sound) {
            Some(container) => (container, None),
            None => {
                room::remove(&place);
                let built = self.build(image, layers, &place, options, progress)?;
                if self.key(image, options, &()).map_or(true, |(after, _)| after != name) {
                    room::remove(&place);
                    return Err(CacheError::Changed(image.into()));
                }
                (Container::open_file(&place)?, Some(built))
            }
        };
        drop(lock);
        room::make(&self.directory, self.budget, &name);
        Ok(CachedImage { container, built })
    }

    /// The name of an image's container, and the image, opened.
    fn key(
        &self,
        image: &Path,
        options: &BuildOptions,
        progress: &dyn Progress,
    ) -> Result<(String, Vec<OpenLayer>), CacheError> {
        let layers = build::open(vec![image.into()], &self.directory.join("image"), options, progress)?;
        Ok((key::of(image, &layers, options, progress)?, layers))
    }

    /// The right to build an image, once no other program has it.
    fn lock(&self, name: &str, progress: &dyn Progress) -> Result<File, CacheError> {
        loop {
            match room::lock(&self.directory, name).map_err(self.unusable())? {
                // Without locks, all are alone.
                Lock::Ours(lock) | Lock::Unknown(lock) => return Ok(lock),
                Lock::Taken => {}
            }
            if progress.wait().is_break() {
                return Err(BuildError::Cancelled.into());
            }
            std::thread::sleep(LOOK_AGAIN);
        }
    }

    /// Builds it, with the lock.
    fn build(
        &self,
        image: &Path,
        layers: Vec<OpenLayer>,
        place: &Path,
        options: &BuildOptions,
        progress: &dyn Progress,
    ) -> Result<BuildReport, CacheError> {
        let name = place.file_name().unwrap_or_default().to_string_lossy();
        room::make(&self.directory, self.budget, &name);
        let mut opened = Some(layers);
        let (mut is_anew, mut has_made_room) = (false, false);
        loop {
            let layers = match opened.take() {
                Some(layers) => Ok(layers),
                None => build::open(vec![image.into()], place, options, progress),
            };
            let built =
                layers.and_then(|mut layers| build::run(&mut layers, place, options, Stage::Whole, progress));
            match built {
                Err(BuildError::Output(WriteError::OtherBuild { .. })) if !is_anew => {
                    is_anew = true;
                    room::remove_unfinished(place);
                }
                Err(BuildError::Output(WriteError::Io { error, .. }))
                    if error.kind() == io::ErrorKind::StorageFull && !has_made_room =>
                {
                    has_made_room = true;
                    room::make(&self.directory, 0, &name);
                }
                Err(error) => {
                    let is_of_image = matches!(&error, BuildError::Input { fault, .. } if !matches!(fault, InputFault::Io(_)));
                    if is_of_image {
                        room::remove_unfinished(place);
                    }
                    return Err(error.into());
                }
                Ok(built) => return Ok(built),
            }
        }
    }

    fn unusable(&self) -> impl Fn(io::Error) -> CacheError + '_ {
        |error| CacheError::Unusable { directory: self.directory.clone(), error }
    }
}

/// The options of what is kept.
fn built_with(options: &BuildOptions) -> BuildOptions {
    let insets = Vec::new();
    BuildOptions { resume: true, durable: true, part: None, keep_levels: false, insets, ..options.clone() }
}

/// The container at a place; `None` if there is none that is whole. What is no sound container, a build
/// replaces.
fn whole(place: &Path) -> Result<Option<Container>, CacheError> {
    if !place.exists() {
        return Ok(None);
    }
    match Container::open_file(place) {
        Ok(container) => {
            mark_as_opened(place);
            Ok(Some(container))
        }
        // It may have gone since, else it cannot be read now, which says nothing about what it holds.
        Err(ContainerError::Store(_)) if !place.exists() => Ok(None),
        Err(error @ ContainerError::Store(_)) => Err(error.into()),
        Err(_) => Ok(None),
    }
}

/// Says that a container was opened just now, whether or not the file system keeps such times by itself.
/// Where that cannot be said, the container only goes earlier.
fn mark_as_opened(place: &Path) {
    // Windows wants the right to write for that.
    if let Ok(file) = File::options().write(true).open(place).or_else(|_| File::open(place)) {
        let _ = file.set_times(FileTimes::new().set_accessed(SystemTime::now()));
    }
}

#[cfg(test)]
mod tests;
