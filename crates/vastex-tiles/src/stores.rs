//! Stores: where the bytes of a source lie.
//!
//! A [`Store`] is read by ranges, so that a local file, a URL and memory are read by the same code. What the bytes mean
//! is the source's business.

use std::future::Future;
use std::pin::Pin;

use bytes::Bytes;

use crate::source::{MaybeSend, MaybeSync};

/// Why a store could not be opened or read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// There is nothing to read here.
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

/// A ranged read under way. Dropping it cancels the read.
#[cfg(not(target_family = "wasm"))]
pub type StoreFuture<'a> = Pin<Box<dyn Future<Output = Result<Bytes, StoreError>> + Send + 'a>>;
/// A ranged read under way. Dropping it cancels the read.
#[cfg(target_family = "wasm")]
pub type StoreFuture<'a> = Pin<Box<dyn Future<Output = Result<Bytes, StoreError>> + 'a>>;

/// Bytes that can be read by ranges. Shared by threads.
pub trait Store: MaybeSend + MaybeSync {
    /// What to call the store in messages: a path or a URL.
    fn name(&self) -> &str;

    /// Bytes in the store, as known since it was opened.
    fn len(&self) -> u64;

    /// Whether the store has no bytes.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Exactly `len` bytes from `offset` on, or an error. `len` is at most the store's length: the caller has checked.
    fn read(&self, offset: u64, len: usize) -> StoreFuture<'_>;
}

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

#[cfg(not(target_family = "wasm"))]
pub use file::FileStore;

#[cfg(not(target_family = "wasm"))]
mod file {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    use super::{Store, StoreError, StoreFuture};

    /// A local file, read at positions: any number of threads at once, without a lock.
    #[derive(Debug)]
    pub struct FileStore {
        name: String,
        file: File,
        len: u64,
    }

    impl FileStore {
        /// Opens a file; fails where it is a directory, empty or unreadable.
        pub fn open(path: impl AsRef<Path>) -> Result<FileStore, StoreError> {
            let path = path.as_ref();
            let name = path.display().to_string();
            let refuse = |error: String| StoreError::Open { name: name.clone(), error };
            // Looked at before it is opened: opening a pipe would wait for a writer.
            let metadata = std::fs::metadata(path).map_err(|e| refuse(advice(&e)))?;
            if metadata.is_dir() {
                return Err(refuse("this is a directory; name a file in it".into()));
            }
            if !metadata.is_file() {
                return Err(refuse("this is a device or a pipe; copy its bytes into a file first".into()));
            }
            if metadata.len() == 0 {
                return Err(refuse("the file is empty; build it again, or copy it anew".into()));
            }
            let file = File::open(path).map_err(|e| refuse(advice(&e)))?;
            Ok(FileStore { len: metadata.len(), name, file })
        }
    }

    fn advice(error: &io::Error) -> String {
        match error.kind() {
            io::ErrorKind::NotFound => "there is no such file; check the path".into(),
            io::ErrorKind::PermissionDenied => "the file may not be read; change its permissions".into(),
            _ => error.to_string(),
        }
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

        fn read(&self, offset: u64, len: usize) -> StoreFuture<'_> {
            Box::pin(async move {
                let failed = |error| StoreError::Read { name: self.name.clone(), offset, len, error };
                // A file may be sparse, so that a length within it is no promise of memory.
                let mut bytes = Vec::new();
                bytes
                    .try_reserve_exact(len)
                    .map_err(|e| failed(format!("{e}; the file is damaged, copy it anew")))?;
                bytes.resize(len, 0);
                match read_exact_at(&self.file, &mut bytes, offset) {
                    Ok(()) => Ok(bytes.into()),
                    Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
                        Err(failed("the file has become shorter; copy it anew".into()))
                    }
                    Err(e) => Err(failed(e.to_string())),
                }
            })
        }
    }

    #[cfg(unix)]
    fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
    }

    #[cfg(windows)]
    fn read_exact_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
        while !bytes.is_empty() {
            match std::os::windows::fs::FileExt::seek_read(file, bytes, offset) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(n) => {
                    bytes = &mut bytes[n..];
                    offset += n as u64;
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(store: &dyn Store, bytes: &[u8]) {
        assert_eq!((store.len(), store.is_empty()), (bytes.len() as u64, bytes.is_empty()));
        for (offset, len) in [(0, bytes.len()), (1, 2), (bytes.len(), 0)] {
            let read = pollster::block_on(store.read(offset as u64, len)).unwrap();
            assert_eq!(read, bytes[offset..offset + len]);
        }
        for (offset, len) in [(0, bytes.len() + 1), (bytes.len(), 1), (usize::MAX, 1)] {
            let error = pollster::block_on(store.read(offset as u64, len)).unwrap_err();
            assert!(error.to_string().contains(store.name()), "{error}");
        }
    }

    #[test]
    fn stores_give_exactly_the_range() {
        check(&MemoryStore::new("memory", vec![1, 2, 3, 4]), &[1, 2, 3, 4]);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        std::fs::write(&path, [1, 2, 3, 4]).unwrap();
        check(&FileStore::open(&path).unwrap(), &[1, 2, 3, 4]);
    }

    #[test]
    fn a_file_that_shrinks_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bytes");
        std::fs::write(&path, [0; 100]).unwrap();
        let store = FileStore::open(&path).unwrap();
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(50).unwrap();
        let error = pollster::block_on(store.read(40, 20)).unwrap_err().to_string();
        assert!(error.contains("shorter"), "{error}");
    }

    #[test]
    fn what_is_no_readable_file_is_refused_with_the_remedy() {
        let dir = tempfile::tempdir().unwrap();
        let refused = |path: &std::path::Path| FileStore::open(path).unwrap_err().to_string();
        assert!(refused(dir.path()).ends_with("this is a directory; name a file in it"));
        assert!(refused(&dir.path().join("none")).ends_with("there is no such file; check the path"));
        let empty = dir.path().join("empty");
        std::fs::write(&empty, []).unwrap();
        assert!(refused(&empty).contains("is empty"));
    }
}
