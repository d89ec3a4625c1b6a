//! Image files, mosaics and tile directories, read row by row from the top.
//!
//! [`open()`] picks the reader. A reader tells size, texels and what it will cost from the header alone,
//! before it allocates anything that depends on them ([`header`]). What becomes of the rows is
//! [`crate::texels`]' and [`crate::pyramid`]'s business.

mod ahead;
mod alpha;
mod beginning;
pub(crate) mod color;
mod exif;
mod exr;
pub(crate) mod fault;
mod file;
pub(crate) mod grids;
pub(crate) mod header;
mod inks;
mod jpeg;
mod mosaic;
pub(crate) mod notice;
mod number;
mod open;
mod open_files;
mod oriented;
mod picture;
pub(crate) mod pixel;
mod png;
mod positioned;
mod quiet;
mod raw;
mod shrunk;
pub(crate) mod stored_as;
#[cfg(test)]
mod tests;
pub(crate) mod tiff;

pub use ahead::Helpers;
#[cfg(test)]
pub(crate) use ahead::{Watch, tests::Rendezvous};
pub use beginning::Beginning;
pub use color::{Profile, in_srgb};
pub use fault::InputFault;
pub use header::{ImageHeader, RowReader};
pub use notice::Notice;
pub use number::Number;
pub(crate) use open::{Opened, open_stored, open_with_files_while};
pub use open::{files_of_image, open, open_reduced, open_shrunk, open_while};
pub use pixel::{PixelFormat, Sample};
pub use stored_as::{Converted, ConvertedPieces};
pub use tiff::file::about::{GeoPlace, PixelSize, TiffAbout};
pub use tiff::file::pyramid::{
    FIRST_IMAGE, TiffOther, bands_in_name, bands_to_choose, image_in_file, means_first_image,
};
