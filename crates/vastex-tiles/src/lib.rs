//! The part of Vastex that fetches.
//!
//! A [`Store`] is where bytes lie; a [`TileSource`] turns a page into a tile. Sources are the `.vastex`
//! [`Container`], sources that generate their tiles, and decorators that cache, limit and stage the tiles of
//! another source or inject faults into its reads. The [`Loader`] reads and decodes tiles on its threads, in
//! the order in which the pager asks for them.
//!
//! This crate does not decide what is loaded (`vastex-core` does) and never sees a GPU.

mod caches;
mod container;
mod exchange;
mod ground;
mod loader;
mod sources;
mod stores;
mod testing;
mod tile;

#[cfg(not(target_family = "wasm"))]
pub use caches::{DiskCache, DiskTier, DiskTierError};
pub use caches::{RamBudget, RamCache};
#[cfg(not(target_family = "wasm"))]
pub use container::verify_file;
pub use container::{Container, ContainerError, Fault, Info, Saved, Verification, verify};
#[cfg(all(feature = "write", not(target_family = "wasm")))]
pub use container::{ContainerUpdate, ReorderError, UpdateError, Updated, reorder, rewrite};
pub use container::{ContainerVolume, filter_without, nodata_of_filter};
#[cfg(feature = "write")]
pub use container::{
    ContainerWriter, Left, MergeError, Origin, PartOf, PartWriter, ResumableWriter, TempFile, WriteError,
    WriterOptions, Written, merge, remove_abandoned, resolved, write_advice,
};
pub use exchange::{npy_header, raw_description, raw_file};
pub use ground::advice::read_advice;
pub use ground::place::{lies_in, same_file};
pub use ground::srgb::{SRGB, Srgb, linear_from_srgb, srgb_from_linear};
pub use ground::sync::{MaybeSend, MaybeSync};
pub use loader::{Clock, LoadError, Loaded, Loader, LoaderSettings, LocalLoader, SystemClock};
pub use sources::{
    ChunkStats, ImageOptions, ImageSource, ImageSourceError, LimitedSource, PlanetError, PlanetImage,
    PlanetSource, PropertySource, ReadError, ReadFuture, Reduction, Room, SourceKey, Staged, StagedSource,
    Staging, StoreCounter, StoreStats, TierStats, Tiers, TileSource,
};
#[cfg(not(target_family = "wasm"))]
pub use stores::{DirectStore, FileStore};
pub use stores::{MemoryStore, ReadLimit, Store, StoreError, StoreFuture};
pub use testing::{FaultRates, Faults, Injection};
#[cfg(not(target_family = "wasm"))]
pub use testing::{conformance, ends_within};
#[cfg(feature = "write")]
pub use tile::EncodedTile;
pub use tile::{Codec, Compression, DecodeError, MAX_TILE_BYTES, Tile};
#[cfg(feature = "blocks")]
pub use tile::{decode_blocks, decode_layer};
