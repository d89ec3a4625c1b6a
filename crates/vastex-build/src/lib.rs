//! The part of Vastex that prepares: from an image file to a `.vastex` container, in one pass over its rows.
//!
//! [`build()`] reads images, raw files, mosaics and tile directories row by row, makes every level, cuts
//! tiles with their borders and drives the container's writer. Memory follows the width of the image, never
//! its height; what a file makes impossible to read by rows is reported as a [`Notice`]. The bytes written
//! depend on the image and the options, and not on the number of threads. A pyramid's own levels can be kept
//! instead ([`BuildOptions::keep_levels`]).
//!
//! [`replace()`] puts an image into a region of a container that was built here, on all levels; [`build()`]
//! puts an [`Inset`] into the texture in the same way, on levels that exist only where insets are.
//!
//! [`export()`] goes the other way: from a texture to the tile directories of other programs, which
//! [`build()`] reads too, and a [`DirectorySource`] shows without a build.
//!
//! A [`BuildCache`] keeps containers of images that nobody built, for programs that show such an image at
//! once. During the build such a program shows a [`MemoryImage`]: a smaller copy of the whole image if there
//! is a quick way to that ([`open_reduced`]), or the rows that the build has read. [`Decoding`] makes one
//! without any build; of pictures that take too much memory to be turned, [`open_shrunk`] gives a share.
//!
//! A [`BlockSource`] compresses the tiles of another source as they are read.
//!
//! [`build_volume`] (feature `volumes`) makes containers and OME-Zarr of volumes, with all of their levels,
//! in one pass over blocks of voxels.
//!
//! Not here: the container's bytes (`vastex-tiles`), the shape of levels, pages and borders (`vastex-core`).

mod block_source;
mod build;
mod cache;
mod crop;
mod export;
mod image;
mod inset;
mod keep_levels;
#[cfg(all(feature = "bc", any(test, feature = "measure")))]
#[doc(hidden)]
pub mod measure;
mod memory_image;
mod new_directory;
mod progress;
mod pyramid;
mod replace;
mod source;
mod texels;
mod threads;
mod tile;
#[cfg(feature = "volumes")]
mod volume;

use std::path::Path;

pub use block_source::{BlockSource, BlockSourceError};
pub use build::{
    BuildError, BuildOptions, BuildReport, Inset, LayerReport, NodataRule, ParseNodataRuleError,
};
pub use cache::{BuildCache, CacheError, CachedImage};
pub use crop::{CropError, CropFormat, CropRegion, CropSource, crop};
pub use export::{ExportError, ExportOptions, ExportReport, Layout, TileFormat, export};
pub use image::{
    Beginning, Converted, ConvertedPieces, FIRST_IMAGE, GeoPlace, Helpers, ImageHeader, InputFault, Notice,
    Number, PixelFormat, PixelSize, Profile, RowReader, Sample, TiffAbout, TiffOther, bands_in_name,
    bands_to_choose, files_of_image, image_in_file, in_srgb, means_first_image, open, open_reduced,
    open_shrunk, open_while,
};
pub use memory_image::{DecodeOptions, Decoding, MemoryImage};
pub use progress::{Progress, read_first_rows, read_further_rows};
pub use replace::{LayerImage, ReplaceError, ReplaceOptions, Replaced, replace};
pub use source::{DirectorySource, SourceError, TiffDirectories, TiffFacts, TiffLevel, TiffSource};
pub use texels::{FilterError, Kernel, LayerFilter, LayerInput, LevelsFrom, Meaning, Quality};
pub use threads::{ThreadsError, give_way};
pub use tile::LayerFault;
pub use vastex_tiles::{
    Compression, MergeError, PartOf, ReorderError, UpdateError, Updated, WriteError, Written, merge, reorder,
};
#[cfg(feature = "volumes")]
pub use volume::{
    ContainerOptions, VolumeBuildError, VolumeFormat, VolumeOptions, VolumeReport, ZarrCodec, ZarrOptions,
    ZarrVersion, build_volume,
};

/// Makes a container of the images in `inputs`: a path for the one layer `color`, or a [`LayerInput`] for
/// each layer.
///
/// The largest image has the texture's size; every other has that too, or half or a quarter of it, rounded
/// up, and is stored at that share of the resolution. One of another size is resampled to the nearest of
/// these, with a notice.
///
/// The file appears at `output`, over what was there, when it is whole; after an error or a cancellation
/// nothing is left behind, unless [`BuildOptions::resume`] asks for it. Takes one pass over the images, in
/// step with one another (over the tiles of a pyramid whose levels are kept), and memory as
/// [`BuildReport::memory`] says.
pub fn build<I: Clone + Into<LayerInput>>(
    inputs: &[I],
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    let inputs: Vec<LayerInput> = inputs.iter().cloned().map(Into::into).collect();
    if options.keep_levels {
        return keep_levels::build(&inputs, output, options, progress);
    }
    let mut layers = build::open(inputs, output, options, progress)?;
    match options.insets.as_slice() {
        [] => build::run(&mut layers, output, options, build::Stage::Whole, progress),
        _ => inset::build(layers, output, options, progress),
    }
}
