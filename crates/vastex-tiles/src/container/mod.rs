//! The `.vastex` container: one file with a header, a description, tiles and an index.
//!
//! `docs/format.md` describes it byte by byte. [`Container`] reads it by ranges, `ContainerWriter` writes it streaming,
//! `ContainerUpdate` changes one in place, [`verify`] reads and checks everything. What a tile's bytes mean is [`crate::Tile`]'s business, which pages are built
//! from what the builder's.

mod description;
mod error;
mod header;
mod index;
mod info;
#[cfg(feature = "write")]
mod journal;
mod layout;
#[cfg(feature = "write")]
mod merge;
#[cfg(feature = "write")]
mod output;
#[cfg(feature = "write")]
mod part;
mod reader;
#[cfg(all(feature = "write", not(target_family = "wasm")))]
mod reorder;
#[cfg(feature = "write")]
mod resume;
#[cfg(feature = "write")]
mod tile_head;
#[cfg(all(feature = "write", not(target_family = "wasm")))]
mod update;
mod verify;
#[cfg(feature = "write")]
mod writer;

#[cfg(test)]
#[cfg(feature = "write")]
mod tests;

#[cfg(not(target_family = "wasm"))]
pub(crate) use description::bytes as description_bytes;
pub use error::ContainerError;
pub use info::{Info, Saved};
#[cfg(feature = "write")]
pub use merge::{MergeError, merge};
#[cfg(feature = "write")]
pub use output::{TempFile, remove_abandoned, write_advice};
#[cfg(feature = "write")]
pub use part::{PartOf, PartWriter};
pub use reader::Container;
#[cfg(all(feature = "write", not(target_family = "wasm")))]
pub use reorder::{ReorderError, reorder, rewrite};
#[cfg(feature = "write")]
pub use resume::{Left, Origin, ResumableWriter};
#[cfg(all(feature = "write", not(target_family = "wasm")))]
pub use update::{ContainerUpdate, UpdateError, Updated};
#[cfg(not(target_family = "wasm"))]
pub use verify::verify_file;
pub use verify::{Fault, Verification, verify};
#[cfg(feature = "write")]
pub use writer::{ContainerWriter, WriteError, WriterOptions, Written};
