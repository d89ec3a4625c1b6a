//! The `.vastex` container: one file with a header, a description, tiles and an index.
//!
//! `docs/format.md` describes the file byte by byte, and `format` is that page as code. `read` opens a file,
//! reads its tiles by ranges, counts and verifies them. `write` makes, resumes, joins and changes files; a
//! program that only reads is compiled without it. How a tile's bytes are encoded is the business of
//! [`Tile`](crate::Tile); which pages are built, and from what, that of the builder.

#[cfg_attr(not(feature = "write"), allow(dead_code, reason = "what only reads uses half of each codec"))]
mod format;
mod read;
#[cfg(feature = "write")]
mod write;

#[cfg(test)]
#[cfg(feature = "write")]
mod tests;

#[cfg(not(target_family = "wasm"))]
pub(crate) use format::description::bytes as description_bytes;
pub use format::description::{ContainerVolume, filter_without, nodata_of_filter};
pub use format::error::ContainerError;
pub use read::*;
#[cfg(feature = "write")]
pub use write::*;
