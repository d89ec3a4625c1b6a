//! The part of Vastex that fetches.
//!
//! A [`TileSource`] turns a page into a tile; a store is where its bytes lie. Here are the `.vastex` container, a
//! generated source, the decorators that cache and that inject faults, and the loader that follows the pager's
//! order on its threads.
//!
//! This crate does not decide what is loaded (`vastex-core` does) and never sees a GPU.

mod source;
mod tile;

pub use source::{MaybeSend, MaybeSync, ReadError, ReadFuture, TileSource};
pub use tile::{Codec, DecodeError, Tile};
