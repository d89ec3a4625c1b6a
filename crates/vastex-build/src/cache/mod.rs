//! Containers of images that nobody built, kept in a directory, so that an image is built once and opens at
//! once from then on. Nothing is written beside the image.
//!
//! The contract:
//!
//! - **The image as it is now.** A container belongs to what the image's files are called, how long they are,
//!   when they were changed, what their first and last MiB hold, the build's options and the version of
//!   Vastex. An image that changes while it is built is an error, and nothing of it stays.
//! - **Nothing is lost.** What an interrupted build made stays, and the next one goes on with it; so it does
//!   after a crash.
//! - **Several programs** may share the directory. Two that want the same image build it once: the second
//!   waits for the first.
//! - **The budget** bounds the containers and the unfinished builds together, but for the container that is
//!   opened, which may be larger: after each build those that were not opened for longest go. A program that
//!   has one open goes on reading it.
//!
//! How a container is built is `build`'s business; which files are images, `image`'s.

mod key;
mod room;

use std::fs::{File, FileTimes};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use vastex_tiles::{Container, ContainerError, WriteError};

use crate::build::{self, BuildError, BuildOptions, BuildReport, Stage};
use crate::image::{InputFault, open_with_files};
use crate::progress::Progress;

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
    /// Its container.
    pub container: Container,
    /// How it was built, where it was not there.
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

    /// The directory that the system's rules give to Vastex: `vastex` in `$XDG_CACHE_HOME`, in `%LOCALAPPDATA%`
    /// on Windows, or else in `~/.cache`; in `~/Library/Caches` on Apple's systems. Nothing where neither is
    /// set to an absolute path.
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
    /// `options` decide what is built; their `resume` is always on, and `part` and `insets` must be left at
    /// their defaults. `progress` hears of the build as from [`crate::build()`], and may stop it, and waiting for
    /// another program, too: what is built stays. Where the container is there, this reads 2 MiB of the image,
    /// and the container's index. Fails where [`crate::build()`] would.
    pub fn open(
        &self,
        image: &Path,
        options: &BuildOptions,
        progress: &dyn Progress,
    ) -> Result<CachedImage, CacheError> {
        let options = BuildOptions { resume: true, ..options.clone() };
        let of_input = |fault| BuildError::Input { path: image.into(), fault };
        let files = open_with_files(image).map_err(of_input)?.files;
        let key = || key::of(&files, &options).map_err(|error| of_input(InputFault::Io(error)));
        let before = key()?;
        let place = self.directory.join(room::name_of(before));
        let mut built = None;
        // A second time where another program removed it meanwhile, or it was damaged.
        for attempt in 0..3 {
            match Container::open_file(&place) {
                Ok(container) => {
                    mark_as_opened(&place);
                    return Ok(CachedImage { container, built });
                }
                Err(error) if attempt == 2 => return Err(error.into()),
                // A container that is not whole is worth less than the image.
                Err(_) => room::remove(&place),
            }
            built = self.build(image, &place, &options, progress)?;
            if key()? != before {
                room::remove(&place);
                return Err(CacheError::Changed(image.into()));
            }
            room::make(&self.directory, self.budget, &place);
        }
        Err(CacheError::Changed(image.into()))
    }

    /// Builds it, or waits until another program has done so.
    fn build(
        &self,
        image: &Path,
        place: &Path,
        options: &BuildOptions,
        progress: &dyn Progress,
    ) -> Result<Option<BuildReport>, CacheError> {
        let unusable = |error| CacheError::Unusable { directory: self.directory.clone(), error };
        std::fs::create_dir_all(&self.directory).map_err(unusable)?;
        let mut is_anew = false;
        loop {
            let options = BuildOptions { resume: !is_anew, ..options.clone() };
            let layers = build::open(vec![image.into()], place, &options);
            let built = layers
                .and_then(|mut layers| build::run(&mut layers, place, &options, Stage::Whole, progress));
            match built {
                Ok(report) => return Ok(Some(report)),
                Err(BuildError::Output(WriteError::InUse { .. })) => {
                    std::thread::sleep(LOOK_AGAIN);
                    if place.exists() {
                        return Ok(None);
                    }
                    if progress.advance(0, 0, 0).is_break() {
                        return Err(BuildError::Cancelled.into());
                    }
                }
                // Its first and last MiB are those of another image.
                Err(BuildError::Output(WriteError::OtherBuild { .. })) if !is_anew => is_anew = true,
                Err(error) => {
                    let goes_on =
                        matches!(error, BuildError::Cancelled | BuildError::Output(WriteError::Io { .. }));
                    if !goes_on {
                        room::remove_unfinished(place);
                    }
                    return Err(error.into());
                }
            }
        }
    }
}

/// Says that a container was opened just now, whether or not the file system keeps such times by itself.
/// Where that cannot be said, the container only goes earlier.
fn mark_as_opened(place: &Path) {
    if let Ok(file) = File::open(place) {
        let _ = file.set_times(FileTimes::new().set_accessed(SystemTime::now()));
    }
}

#[cfg(test)]
mod tests;
