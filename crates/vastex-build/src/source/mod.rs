//! What others wrote, shown where it lies: tile directories and TIFF pyramids as sources of tiles, without a
//! build.
//!
//! Both are [`cells`] on levels; [`pages`] puts pages and borders together from them and makes the levels
//! that are missing. What a directory is, its layout's module of `image/grids` says ([`directory`]); which
//! images of a TIFF file are levels, `image/tiff/file` ([`pyramid`]); they are found once for all who ask
//! ([`tiff_directories`]). What is kept decoded is in [`kept`], and
//! what numbers lose on the way in [`losses`].

mod cells;
mod directory;
mod identity;
mod interpolate;
mod kept;
mod losses;
mod pages;
mod pyramid;
mod tiff_directories;

use std::path::PathBuf;

use vastex_core::{GeometryError, PagePos};
use vastex_tiles::ReadError;

use crate::image::InputFault;

pub use directory::DirectorySource;
pub(crate) use pages::Shape;
pub use pyramid::{TiffFacts, TiffLevel, TiffSource};
pub use tiff_directories::TiffDirectories;

/// Why a tile directory or an image cannot be shown where it lies.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The directory, a file in it or the image cannot be read.
    #[error("{path}: {fault}", path = path.display())]
    Input {
        /// The directory, the file that describes it, or the image.
        path: PathBuf,
        /// What is wrong with the file.
        #[source]
        fault: InputFault,
    },
    /// Whoever was told how far its opening was had it broken off.
    #[error("{path}: opening it was broken off", path = path.display())]
    BrokenOff {
        /// The directory, or the image.
        path: PathBuf,
    },
    /// The source's levels have an impossible size.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
}

fn read_error(pos: PagePos, fault: &InputFault) -> ReadError {
    let (place, fault) = match fault {
        InputFault::Tile { path, fault } => (path.display().to_string(), &**fault),
        fault => (String::new(), fault),
    };
    match fault {
        InputFault::Io(_) => ReadError::Store { pos, place, error: fault.to_string() },
        fault => ReadError::Damaged { pos, place, fault: fault.to_string() },
    }
}
