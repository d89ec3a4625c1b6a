//! Values one after the other in a file: NIfTI and raw files. They are read in place, or from memory where
//! the file is compressed.

mod array;
mod nifti;
mod raw;

pub(crate) use array::{FlatArray, Layout, Place};
pub(crate) use nifti::{has_name_of_values, header_of, image_of, is_nifti, open_nifti};
pub(crate) use raw::{is_raw_volume, open_raw};
