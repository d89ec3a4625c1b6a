//! Stores: where the bytes of a source lie.
//!
//! A [`Store`] is read by ranges, so that a local file, a URL and memory are read by the same code. What the
//! bytes mean is the source's business.

#[cfg(not(target_family = "wasm"))]
mod direct;
#[cfg(not(target_family = "wasm"))]
mod file;
mod limit;
mod memory;
#[cfg(test)]
mod tests;

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use bytes::Bytes;

use crate::ground::sync::{MaybeSend, MaybeSync};

#[cfg(not(target_family = "wasm"))]
pub use direct::DirectStore;
#[cfg(not(target_family = "wasm"))]
pub use file::FileStore;
#[cfg(not(target_family = "wasm"))]
pub(crate) use file::read_at;
pub use limit::ReadLimit;
pub use memory::MemoryStore;

/// Why a store could not be opened or read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// The store cannot be opened.
    #[error("{name}: {error}")]
    Open {
        /// The file or URL.
        name: String,
        /// What is wrong and what to do.
        error: String,
    },
    /// A range could not be read.
    #[error("{name}, {len} bytes at {offset}: {error}")]
    Read {
        /// The file or URL.
        name: String,
        /// First byte of the range.
        offset: u64,
        /// Bytes of the range.
        len: usize,
        /// What the system said.
        error: String,
    },
}

/// A read of a range under way. Dropping the future cancels the read.
#[cfg(not(target_family = "wasm"))]
pub type StoreFuture<'a> = Pin<Box<dyn Future<Output = Result<Bytes, StoreError>> + Send + 'a>>;
/// A read of a range under way. Dropping the future cancels the read.
#[cfg(target_family = "wasm")]
pub type StoreFuture<'a> = Pin<Box<dyn Future<Output = Result<Bytes, StoreError>> + 'a>>;

/// Bytes that can be read by ranges. Shared by threads.
pub trait Store: MaybeSend + MaybeSync {
    /// The name of the store in messages: a path or a URL.
    fn name(&self) -> &str;

    /// The number of bytes in the store, as known since it was opened.
    fn len(&self) -> u64;

    /// Returns true if the store has no bytes.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns true if reads go to the disk itself, past the system's page cache.
    fn is_direct(&self) -> bool {
        false
    }

    /// The limit of reads of this store under way at once, if it has one; the store keeps to it by itself.
    /// The same at every call.
    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    /// Reads exactly `len` bytes from `offset` on. `len` is at most the store's length: the caller has
    /// checked that.
    fn read(&self, offset: u64, len: usize) -> StoreFuture<'_>;
}
