//! Caches: decorators that keep the encoded tiles of a source, in main memory (`ram`) and on a disk (`disk`).
//!
//! Each has a budget of bytes that holds at every instant and never gives a tile that the source would not
//! give. What is cached of a texture, and in which order caches stand, is the application's business.

#[cfg(not(target_family = "wasm"))]
mod disk;
mod ram;

#[cfg(not(target_family = "wasm"))]
pub use disk::{DiskCache, DiskTier, DiskTierError};
pub use ram::{RamBudget, RamCache};
