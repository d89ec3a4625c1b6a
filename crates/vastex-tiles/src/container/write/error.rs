//! What can go wrong while a container or a part of one is written.

use vastex_core::PagePos;

use super::output::write_advice;

/// Why a container cannot be written. By then the temporary file is removed, unless it was to be kept.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be created, written or put in its place.
    #[error("{name}: cannot be written: {}", write_advice(error))]
    Io {
        /// The file.
        name: String,
        /// What the system said.
        error: std::io::Error,
    },
    /// A container cannot hold the texture.
    #[error("{name}: {fault}")]
    Description {
        /// The file.
        name: String,
        /// What is too much, and what to change.
        fault: String,
    },
    /// A tile does not belong here.
    #[error("{name}: {pos}: {fault}")]
    Tile {
        /// The file.
        name: String,
        /// The page.
        pos: PagePos,
        /// What is wrong with the tile.
        fault: String,
    },
    /// The tail is missing, without which a texture cannot be shown; or an earlier write failed.
    #[error("{name}: the container is incomplete: {missing}")]
    Incomplete {
        /// The file.
        name: String,
        /// What is missing.
        missing: &'static str,
    },
    /// Another process writes to the same place.
    #[error("{name}: another build is writing this file; wait until it is done, or choose another name")]
    InUse {
        /// The file.
        name: String,
    },
    /// What an interrupted build left is not what this build would write. It is still there.
    #[error(
        "{name}: what an interrupted build left there is of {of}; build without --resume, which starts anew"
    )]
    OtherBuild {
        /// The file.
        name: String,
        /// What the interrupted build was of.
        of: String,
    },
    /// The function that is told of progress asked to stop.
    #[error("{name}: cancelled")]
    Cancelled {
        /// The file.
        name: String,
    },
}

impl WriteError {
    /// Turns an error of the system into one that names the file.
    pub(super) fn io(name: &str) -> impl Fn(std::io::Error) -> WriteError + use<> {
        let name = name.to_owned();
        move |error| WriteError::Io { name: name.clone(), error }
    }
}
