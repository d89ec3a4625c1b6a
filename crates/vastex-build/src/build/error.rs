//! What can go wrong with a build, and what the reader of the message can do about it.
//!
//! What is wrong with an input file, its reader says; [`BuildError`] adds the file's name. What goes wrong
//! with the output is the container writer's to say.

use std::path::{Path, PathBuf};

use vastex_core::{GeometryError, LayerError};
use vastex_tiles::{ReadError, ReorderError, WriteError};

use crate::image::InputFault;
use crate::replace::ReplaceError;
use crate::texels::FilterError;
use crate::threads::ThreadsError;

/// Why nothing was built. No file is left behind, unless what was built so far is to be resumed.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// There is no input.
    #[error("no input: give an image")]
    NoInput,
    /// The input cannot be read.
    #[error("{path}: {fault}", path = path.display())]
    Input {
        /// The input file.
        path: PathBuf,
        /// What is wrong with the file.
        #[source]
        fault: InputFault,
    },
    /// The image, the page or the border has an impossible size.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A filter does not suit its layer, or the filters do not suit one another.
    #[error(transparent)]
    Filter(#[from] FilterError),
    /// The layers do not suit one another or the pages.
    #[error("{error}; {remedy}")]
    Layers {
        /// What does not suit what.
        error: LayerError,
        /// What to do.
        remedy: String,
    },
    /// An image cannot become a layer of the format asked for.
    #[error("{path}: holds {image}, which cannot become {format}; choose one of {possible}", path = path.display())]
    Format {
        /// The image.
        path: PathBuf,
        /// What the image's texels are.
        image: String,
        /// Name of the format asked for.
        format: &'static str,
        /// Names of the formats that it can become.
        possible: String,
    },
    /// Block-compressed layers are asked for, and the encoders are not linked.
    #[error(
        "{0} cannot be made: this was built without the encoders of block-compressed formats (feature bc)"
    )]
    NoEncoders(&'static str),
    /// More memory would be needed than is allowed.
    #[error(
        "{path}: needs {} MiB of memory, more than the limit of {} MiB; {remedy}",
        needed >> 20, limit >> 20, path = path.display()
    )]
    Memory {
        /// The input file.
        path: PathBuf,
        /// Bytes that the build would take.
        needed: u64,
        /// Bytes that [`crate::BuildOptions::memory_limit`] allows, or
        /// [`crate::DecodeOptions::reader_bytes`].
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// The output would overwrite a file of an input: the image, its description, a piece of a mosaic, a
    /// mask, an inset.
    #[error("{}: is read as an input, and the output would replace it; choose another name for the output", .0.display())]
    SameFile(PathBuf),
    /// The output would lie among the tiles of the input.
    #[error(
        "{output}: lies in {directory}, which is the input; choose a place outside it",
        output = output.display(), directory = directory.display()
    )]
    AmongTiles {
        /// The output.
        output: PathBuf,
        /// The directory of the input's tiles.
        directory: PathBuf,
    },
    /// Transparent pages are to be left out, but nothing can be transparent.
    #[error(
        "no layer has an alpha channel, so none can say which pages are transparent; give a mask instead"
    )]
    NoAlpha,
    /// The levels of a pyramid are to be kept, and another option does not go with that.
    #[error(
        "the levels of a pyramid cannot be kept with {0}; leave that out, or have them made anew (--levels new)"
    )]
    KeptLevels(&'static str),
    /// The levels of a pyramid are to be kept, and the input is none.
    #[error("{}: {why}, so it has no levels to keep; have them made (--levels new)", path.display())]
    NoLevels {
        /// The input.
        path: PathBuf,
        /// What the source is.
        why: String,
    },
    /// A tile of a pyramid whose levels are kept cannot be read.
    #[error("{path}: {error}", path = path.display())]
    Tile {
        /// The input.
        path: PathBuf,
        /// What is wrong.
        #[source]
        error: ReadError,
    },
    /// Insets are asked for in a part of a container.
    #[error("insets are put in when the texture is whole: build it on one machine, without --shard")]
    InsetsApart,
    /// The texture is of a kind into which no insets can be put.
    #[error(
        "no inset can be put into the texture: {0}; build each level from the next finer one (--levels-from chain)"
    )]
    InsetTexture(String),
    /// An inset does not say into which of several layers it goes, or names none that there is.
    #[error(
        "{path}: goes into none of the layers {layers}; say into which, as in --inset NAME={path}@X,Y,LEVEL",
        path = path.display()
    )]
    InsetLayer {
        /// The inset's image.
        path: PathBuf,
        /// The layers that there are.
        layers: String,
    },
    /// The insets would make the texture too large.
    #[error(
        "{levels} levels finer than {}x{} texels, which an inset asks for, make a texture of more than 2^31 texels a side; \
         make the inset coarser",
        size[0], size[1]
    )]
    InsetTooFine {
        /// Levels that the finest inset is finer than the image.
        levels: u8,
        /// Size of the image in texels.
        size: [u32; 2],
    },
    /// The image under the insets would lie in the tail with room for finer levels, which nothing could fill.
    #[error(
        "{}x{} texels are too few for insets, since finer levels fit into the same page; enlarge the image {} times, and count \
         the insets' levels from there",
        size[0], size[1], 1u64 << (*levels).min(32)
    )]
    InsetInTail {
        /// Levels that the finest inset is finer than the image.
        levels: u8,
        /// Size of the image in texels.
        size: [u32; 2],
    },
    /// An inset reaches beyond the texture.
    #[error(
        "{}: {}x{} texels at {},{} reach beyond the texture, which has {}x{} texels at that level ({level}); choose another \
         place, or cut the image",
        path.display(), size[0], size[1], at[0], at[1], texture[0], texture[1]
    )]
    InsetOutside {
        /// The inset's image.
        path: PathBuf,
        /// Where the image should go, in its own texels.
        at: [u32; 2],
        /// The image's size in texels.
        size: [u32; 2],
        /// The level of the texture to which it belongs.
        level: u8,
        /// Size of that level in texels.
        texture: [u32; 2],
    },
    /// An inset cannot be put into the texture.
    #[error(transparent)]
    Inset(Box<ReplaceError>),
    /// The file cannot be copied to its place.
    #[error(transparent)]
    Reorder(ReorderError),
    /// The output cannot be written.
    #[error(transparent)]
    Output(WriteError),
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// [`crate::Progress`] asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl BuildError {
    /// An image cannot be opened, or was broken off while it was.
    pub(crate) fn input(path: &Path, fault: InputFault) -> BuildError {
        match fault {
            InputFault::BrokenOff => BuildError::Cancelled,
            fault => BuildError::Input { path: path.into(), fault },
        }
    }

    /// `page` and `border` are those asked for; all layers would suit multiples of `unit`.
    pub(crate) fn layers(error: LayerError, page: u32, border: u32, unit: u32) -> BuildError {
        let remedy = match error {
            LayerError::Blocks { .. } => {
                let [page, border] = [page, border].map(|n| n.next_multiple_of(unit));
                format!("for example pages of {page} with borders of {border}")
            }
            LayerError::Name(_) => "give each a name of its own".into(),
            _ => "choose other layers".into(),
        };
        BuildError::Layers { error, remedy }
    }
}

impl From<WriteError> for BuildError {
    fn from(error: WriteError) -> BuildError {
        match error {
            WriteError::Cancelled { .. } => BuildError::Cancelled,
            error => BuildError::Output(error),
        }
    }
}
