//! Why a region was not replaced.

use std::path::PathBuf;

use vastex_core::PagePos;
use vastex_tiles::{DecodeError, ReadError, UpdateError};

use crate::error::{BuildError, InputFault};

/// Why nothing was replaced. The container is as it was before.
#[derive(Debug, thiserror::Error)]
pub enum ReplaceError {
    /// The image cannot be read.
    #[error("{path}: {fault}", path = path.display())]
    Image {
        /// The image.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        fault: InputFault,
    },
    /// The container cannot be opened or written.
    #[error(transparent)]
    Container(#[from] UpdateError),
    /// The container is of a kind in which no region can be replaced.
    #[error("{name}: {what}; build it again from the whole image")]
    Unsupported {
        /// The container.
        name: String,
        /// What it is.
        what: String,
    },
    /// The image's texels are not those of the container.
    #[error("{path}: holds {image}, which cannot become the container's {container}; convert the image", path = path.display())]
    Format {
        /// The image.
        path: PathBuf,
        /// What its texels are.
        image: String,
        /// The format of the container's layer.
        container: &'static str,
    },
    /// The image reaches beyond the texture.
    #[error(
        "{path}: {}x{} texels at {},{} reach beyond the texture of {}x{}; choose another place, or cut the image",
        size[0], size[1], at[0], at[1], texture[0], texture[1], path = path.display()
    )]
    Outside {
        /// The image.
        path: PathBuf,
        /// Where it should go.
        at: [u32; 2],
        /// Its size in texels.
        size: [u32; 2],
        /// Size of level 0 in texels.
        texture: [u32; 2],
    },
    /// A tile of the container is needed and cannot be had.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A tile of the container is needed and makes no sense.
    #[error("{name}: {pos}: {error}; build the container again")]
    Decode {
        /// The container.
        name: String,
        /// Its page.
        pos: PagePos,
        /// What is wrong with it.
        #[source]
        error: DecodeError,
    },
    /// More memory would be needed than is allowed.
    #[error(
        "{path}: needs {} MiB of memory, more than the limit of {} MiB; cut the image into parts",
        needed >> 20, limit >> 20, path = path.display()
    )]
    Memory {
        /// The image.
        path: PathBuf,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(BuildError),
    /// [`crate::Progress`] asked to stop.
    #[error("cancelled")]
    Cancelled,
}
