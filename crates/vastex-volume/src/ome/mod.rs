//! OME-Zarr, 0.1 to 0.5 and drafts of 0.6: what its metadata mean, read tolerantly. Whatever was odd is said,
//! with what was made of it.

mod axes;
mod image;
mod labels;
mod levels;
mod omero;
mod root;
mod transforms;

pub(crate) use axes::{assign, axes_of_names};
pub(crate) use image::{no_image, open_image};
pub(crate) use root::{Root, open_root};
