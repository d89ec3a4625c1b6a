//! What can go wrong with the build of a volume, and what the reader of the message can do about it.

use std::path::PathBuf;

use vastex_tiles::{WriteError, write_advice};
use vastex_volume::VolumeError;

use crate::new_directory::DirectoryFault;
use crate::threads::ThreadsError;

/// Why no volume was built. Nothing is left behind.
#[derive(Debug, thiserror::Error)]
pub enum VolumeBuildError {
    /// The volume cannot be read.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// What lies at the path lists volumes.
    #[error("{path}: is {what}, of which one image is built at a time; name one below this path: {images}")]
    Images {
        /// What was named.
        path: String,
        /// What lists them.
        what: &'static str,
        /// Some of their paths.
        images: String,
    },
    /// The finest level of the volume cannot be read.
    #[error(
        "{error}; so '{level}', the finest level of {path}, is missing, and what would be built of a coarser one is another volume. Write that level anew, or take it out of the metadata"
    )]
    FinestLeftOut {
        /// The volume.
        path: String,
        /// The level.
        level: String,
        /// Why the level cannot be read.
        error: VolumeError,
    },
    /// Options that do not go together, or not with the volume.
    #[error("{0}")]
    Options(String),
    /// The output would be among what is read, or the other way round.
    #[error("{output}: would be written over, into or around {input}, which is read; choose another place", output = output.display(), input = input.display())]
    Place {
        /// The output.
        output: PathBuf,
        /// What is read.
        input: PathBuf,
    },
    /// The output cannot be made or put in its place.
    #[error("{path}: {why}", path = path.display())]
    Target {
        /// The output.
        path: PathBuf,
        /// What is wrong and what to do.
        why: String,
    },
    /// A file cannot be written.
    #[error("{path}: cannot be written: {why}", path = path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// What the system said, and what to do.
        why: String,
    },
    /// The container cannot be written.
    #[error(transparent)]
    Container(#[from] WriteError),
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// [`crate::Progress`] asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl VolumeBuildError {
    /// A file that the system does not write.
    pub(super) fn output(path: impl Into<PathBuf>, error: &std::io::Error) -> VolumeBuildError {
        VolumeBuildError::Output { path: path.into(), why: write_advice(error) }
    }
}

impl From<DirectoryFault> for VolumeBuildError {
    fn from(fault: DirectoryFault) -> VolumeBuildError {
        match fault {
            DirectoryFault::Target(path, why) => VolumeBuildError::Target { path, why },
            DirectoryFault::Output(path, why) => VolumeBuildError::Output { path, why },
        }
    }
}
