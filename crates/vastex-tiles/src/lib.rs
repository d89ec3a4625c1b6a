//! The part of Vastex that fetches.
//!
//! A [`TileSource`] turns a page into a tile; a [`Store`] is where its bytes lie. Here are the `.vastex` container, a
//! generated source, the decorators that cache and that inject faults, and the loader that follows the pager's
//! order on its threads.
//!
//! This crate does not decide what is loaded (`vastex-core` does) and never sees a GPU.

#[cfg(feature = "blocks")]
mod blocks;
mod cache;
mod clock;
#[cfg(not(target_family = "wasm"))]
mod conformance;
mod container;
#[cfg(not(target_family = "wasm"))]
mod disk;
#[cfg(feature = "write")]
mod encode;
mod faults;
mod hash;
mod limit;
mod loader;
mod planet;
mod property;
mod source;
mod staging;
mod stores;
#[cfg(test)]
#[cfg(feature = "write")]
mod testing;
mod tier;
mod tile;

#[cfg(feature = "blocks")]
pub use blocks::{decode_blocks, decode_layer};
pub use cache::RamCache;
pub use clock::{Clock, SystemClock};
#[cfg(not(target_family = "wasm"))]
pub use conformance::conformance;
#[cfg(not(target_family = "wasm"))]
pub use container::verify_file;
pub use container::{Container, ContainerError, Fault, Info, Saved, Verification, verify};
#[cfg(all(feature = "write", not(target_family = "wasm")))]
pub use container::{ContainerUpdate, ReorderError, UpdateError, Updated, reorder, rewrite};
#[cfg(feature = "write")]
pub use container::{
    ContainerWriter, Left, MergeError, Origin, PartOf, PartWriter, ResumableWriter, TempFile, WriteError,
    WriterOptions, Written, merge, remove_abandoned, write_advice,
};
#[cfg(not(target_family = "wasm"))]
pub use disk::{DiskCache, DiskTier, DiskTierError};
#[cfg(feature = "write")]
pub use encode::{Compression, EncodedTile};
pub use faults::{FaultRates, Faults, Injection};
pub use limit::{LimitedSource, ReadLimit};
pub use loader::{LoadError, Loaded, Loader, LoaderSettings, LocalLoader};
pub use planet::{PlanetError, PlanetImage, PlanetSource};
pub use property::PropertySource;
pub use source::{MaybeSend, MaybeSync, ReadError, ReadFuture, SourceKey, TileSource};
pub use staging::{Room, Staged, StagedSource, Staging};
#[cfg(not(target_family = "wasm"))]
pub use stores::{DirectStore, FileStore};
pub use stores::{MemoryStore, Store, StoreError, StoreFuture};
pub use tier::{StoreCounter, StoreStats, TierStats, Tiers};
pub use tile::{Codec, DecodeError, MAX_TILE_BYTES, Tile};
