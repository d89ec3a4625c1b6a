//! Why a region was not replaced.

use std::path::PathBuf;

use vastex_core::PagePos;
use vastex_tiles::{DecodeError, ReadError, UpdateError};

use crate::image::InputFault;
use crate::threads::ThreadsError;

/// Why nothing was replaced. The container is as it was before.
#[derive(Debug, thiserror::Error)]
pub enum ReplaceError {
    /// The image cannot be read.
    #[error("{path}: {fault}", path = path.display())]
    Image {
        /// The image.
        path: PathBuf,
        /// What is wrong with the image.
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
        /// What the container holds.
        what: String,
    },
    /// The image's texels are not those of the container.
    #[error("{path}: holds {image}, which cannot become the container's {container}; convert the image", path = path.display())]
    Format {
        /// The image.
        path: PathBuf,
        /// What the image's texels are.
        image: String,
        /// The format of the container's layer.
        container: &'static str,
    },
    /// The image reaches beyond the texture.
    #[error(
        "{path}: {}x{} texels at {},{} reach beyond {of} of {}x{}; choose another place, or cut the image",
        size[0], size[1], at[0], at[1], texture[0], texture[1], path = path.display()
    )]
    Outside {
        /// The image.
        path: PathBuf,
        /// Where the image should go, in texels of the layer.
        at: [u32; 2],
        /// The image's size in texels.
        size: [u32; 2],
        /// What the image reaches beyond.
        of: String,
        /// Size of the layer in texels.
        texture: [u32; 2],
    },
    /// An image comes without the name of a layer, and there are several.
    #[error("{name}: has the layers {layers}; say into which of them {path} goes: --layer NAME={path}", path = path.display())]
    WhichLayer {
        /// The container.
        name: String,
        /// The image.
        path: PathBuf,
        /// The container's layers.
        layers: String,
    },
    /// The container has no layer of that name.
    #[error("{name}: has no layer {layer:?}; name one of {layers}")]
    NoSuchLayer {
        /// The container.
        name: String,
        /// The name asked for.
        layer: String,
        /// The layers that it has.
        layers: String,
    },
    /// A layer is given two images.
    #[error("{path}: the layer {layer:?} has an image already; give one for each layer", path = path.display())]
    Twice {
        /// The second image.
        path: PathBuf,
        /// The layer.
        layer: String,
    },
    /// A layer is expected to have another format, or another filter.
    #[error(
        "{name}: its layer {layer:?} has {is}, and not {not}; leave that out, or build the container again from the whole images"
    )]
    Differs {
        /// The container.
        name: String,
        /// The layer.
        layer: String,
        /// Format or filter that it has.
        is: String,
        /// Format or filter that was asked for.
        not: String,
    },
    /// A layer at a fraction of the resolution has no texel that begins there.
    #[error(
        "{path}: {},{} is no whole texel of the layer {layer:?}, which has one along {scale} of the texture; begin at {},{}          instead, for example", at[0], at[1], before[0], before[1], path = path.display()
    )]
    BetweenTexels {
        /// The image.
        path: PathBuf,
        /// The layer.
        layer: String,
        /// Texels of the texture along one of the layer.
        scale: u32,
        /// The place asked for, in texels of the texture.
        at: [u32; 2],
        /// A place before it that would do.
        before: [u32; 2],
    },
    /// The images are not of one region.
    #[error(
        "{path}: has {}x{} texels, and with {of} of {}x{} it must have {}x{}, the layer's share of the same region; scale or cut it",
        size[0], size[1], region[0], region[1], expected[0], expected[1], path = path.display(), of = of.display()
    )]
    Size {
        /// The image.
        path: PathBuf,
        /// The image's size in texels.
        size: [u32; 2],
        /// The size that it must have.
        expected: [u32; 2],
        /// The image that tells the region.
        of: PathBuf,
        /// That one's size in texels.
        region: [u32; 2],
    },
    /// A layer is compressed in blocks, and the encoders are not linked.
    #[error(
        "{name}: has a layer in {format}, and this was built without the encoders of block-compressed formats (feature bc)"
    )]
    NoEncoders {
        /// The container.
        name: String,
        /// The layer's format.
        format: &'static str,
    },
    /// A tile of the container is needed and cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A tile of the container is needed and makes no sense.
    #[error("{name}: {pos}: {error}; build the container again")]
    Decode {
        /// The container.
        name: String,
        /// The page of the tile.
        pos: PagePos,
        /// What is wrong with the tile.
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
    Threads(#[from] ThreadsError),
    /// [`crate::Progress`] asked to stop.
    #[error("cancelled")]
    Cancelled,
}
