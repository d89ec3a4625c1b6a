//! A local file as a store, read through the system's page cache.

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;

use super::{ReadLimit, Store, StoreError, StoreFuture};
use crate::ground::advice::read_advice;

/// A local file, read at positions: any number of threads at once, without a lock.
#[derive(Debug)]
pub struct FileStore {
    name: String,
    file: File,
    len: u64,
}

impl FileStore {
    /// Opens a file. Fails if it is a directory, a device or a pipe, empty or unreadable.
    pub fn open(path: impl AsRef<Path>) -> Result<FileStore, StoreError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let refuse = |error: String| StoreError::Open { name: name.clone(), error };
        // Looked at before it is opened: opening a pipe would wait for a writer.
        let metadata = std::fs::metadata(path).map_err(|e| refuse(read_advice(&e)))?;
        if metadata.is_dir() {
            return Err(refuse("this is a directory; name a file in it".into()));
        }
        if !metadata.is_file() {
            return Err(refuse("this is a device or a pipe; copy its bytes into a file first".into()));
        }
        if metadata.len() == 0 {
            return Err(refuse("the file is empty; build it again, or copy it anew".into()));
        }
        let file = File::open(path).map_err(|e| refuse(read_advice(&e)))?;
        Ok(FileStore { len: metadata.len(), name, file })
    }

    /// The open file, for [`DirectStore`](super::DirectStore), which opens it once more.
    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// As [`Store::read`], without a future.
    pub(super) fn read_now(&self, offset: u64, len: usize) -> Result<Bytes, StoreError> {
        let mut bytes = Vec::new();
        reserve(&mut bytes, len).map_err(|error| self.failed(offset, len, error))?;
        bytes.resize(len, 0);
        match read_at(&self.file, &mut bytes, offset) {
            Ok(count) if count == len => Ok(bytes.into()),
            Ok(_) => Err(self.failed(offset, len, "the file has become shorter; copy it anew".into())),
            Err(error) => Err(self.failed(offset, len, error.to_string())),
        }
    }

    /// The error of a range that could not be read.
    pub(super) fn failed(&self, offset: u64, len: usize, error: String) -> StoreError {
        StoreError::Read { name: self.name.clone(), offset, len, error }
    }
}

/// Memory for a read. A file may be sparse, so that a length within it is no promise of memory.
pub(super) fn reserve(bytes: &mut Vec<u8>, len: usize) -> Result<(), String> {
    bytes.try_reserve_exact(len).map_err(|error| format!("{error}; the file is damaged, copy it anew"))
}

#[deny(clippy::missing_trait_methods)]
impl Store for FileStore {
    fn name(&self) -> &str {
        &self.name
    }

    fn len(&self) -> u64 {
        self.len
    }

    fn is_empty(&self) -> bool {
        self.len == 0
    }

    fn is_direct(&self) -> bool {
        false
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    fn read(&self, offset: u64, len: usize) -> StoreFuture<'_> {
        Box::pin(async move { self.read_now(offset, len) })
    }
}

/// Fills `bytes` from `offset` on, as far as the file reaches; gives back how many there were.
pub(crate) fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    let mut filled = 0;
    while filled < bytes.len() {
        match read_some_at(file, &mut bytes[filled..], offset + filled as u64) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

#[cfg(unix)]
pub(super) fn read_some_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, bytes, offset)
}

#[cfg(windows)]
pub(super) fn read_some_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, bytes, offset)
}
