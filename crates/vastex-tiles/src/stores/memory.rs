//! Bytes in memory as a store: what tests read, and what a program has fetched itself.

use std::sync::Arc;

use bytes::Bytes;

use super::{ReadLimit, Store, StoreError, StoreFuture};

/// Bytes in memory.
#[derive(Clone, Debug)]
pub struct MemoryStore {
    name: String,
    bytes: Bytes,
}

impl MemoryStore {
    /// A store of `bytes`, called `name` in messages.
    pub fn new(name: impl Into<String>, bytes: impl Into<Bytes>) -> MemoryStore {
        MemoryStore { name: name.into(), bytes: bytes.into() }
    }
}

#[deny(clippy::missing_trait_methods)]
impl Store for MemoryStore {
    fn name(&self) -> &str {
        &self.name
    }

    fn len(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    fn is_direct(&self) -> bool {
        false
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    fn read(&self, offset: u64, len: usize) -> StoreFuture<'_> {
        let range = usize::try_from(offset).ok().and_then(|first| Some(first..first.checked_add(len)?));
        let bytes = match range {
            Some(range) if range.end <= self.bytes.len() => Ok(self.bytes.slice(range)),
            _ => Err(StoreError::Read {
                name: self.name.clone(),
                offset,
                len,
                error: format!("there are only {} bytes", self.bytes.len()),
            }),
        };
        Box::pin(std::future::ready(bytes))
    }
}
