//! A local file as a store, read past the system's page cache where the system allows that.
//!
//! Direct reads take whole blocks to memory that begins at a multiple of a block: ranges are widened to
//! blocks, and the store keeps aligned buffers, one for each read under way. What the file system refuses to
//! read directly is read through the cache. The store has no threads: a read is carried out by whoever waits
//! for it, and the limit tells loaders how many reads may go on at once.

use std::fs::File;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::{io, num::NonZeroU32};

use bytes::Bytes;

use super::file::{FileStore, read_some_at, reserve};
use super::{ReadLimit, Store, StoreError, StoreFuture};
use crate::ground::sync::lock;

/// The least block that is read: the page of most memories, and no smaller than the sectors of most disks.
#[cfg(any(target_os = "linux", test))]
const LEAST_BLOCK: u32 = 4096;
/// The most bytes of one read; longer ranges take several, so that the buffers stay small.
const MOST_BYTES: usize = 1 << 20;
/// The most reads at once: no disk gains by more.
const MOST_DEPTH: usize = 64;

/// A local file, read directly from the disk with several reads at once.
///
/// Direct reads leave no copy in the system's page cache, so that a file far larger than memory does not push
/// out what is worth keeping; what is read twice comes from the disk twice. Reading a tile of a container
/// that is aligned to the block costs the tile's bytes, rounded up to blocks. On systems other than Linux,
/// and where the file system refuses direct reads, the store reads as a [`FileStore`] does, and
/// [`Store::is_direct`] returns false.
#[derive(Debug)]
pub struct DirectStore {
    buffered: Arc<FileStore>,
    direct: Option<DirectFile>,
}

impl DirectStore {
    /// A number of reads at once that suits solid-state disks.
    pub const DEFAULT_DEPTH: usize = 8;

    /// Opens a file with at most `depth` reads (1 to 64) at once. Each read blocks the thread that polls it
    /// and takes up to 1 MiB; further reads wait without a thread. A loader has as many threads for them
    /// ([`Store::read_limit`]).
    ///
    /// Fails where a [`FileStore`] fails; that the file cannot be read directly is no failure.
    pub fn open(path: impl AsRef<Path>, depth: usize) -> Result<DirectStore, StoreError> {
        let path = path.as_ref();
        Ok(DirectStore::beside(Arc::new(FileStore::open(path)?), path, depth))
    }

    /// For the file at `path` that `buffered` has opened.
    pub(crate) fn beside(buffered: Arc<FileStore>, path: &Path, depth: usize) -> DirectStore {
        let direct = DirectFile::open(&buffered, path, depth);
        let direct = direct.inspect_err(|e| tracing::info!("{}: no direct reads: {e}", buffered.name())).ok();
        DirectStore { buffered, direct }
    }

    /// Direct reads are widened to multiples of so many bytes; `None` if the file is not read directly.
    pub fn block_bytes(&self) -> Option<NonZeroU32> {
        self.direct.as_ref().map(|file| file.block)
    }
}

#[deny(clippy::missing_trait_methods)]
impl Store for DirectStore {
    fn name(&self) -> &str {
        self.buffered.name()
    }

    fn len(&self) -> u64 {
        self.buffered.len()
    }

    fn is_empty(&self) -> bool {
        self.buffered.is_empty()
    }

    fn is_direct(&self) -> bool {
        self.direct.as_ref().is_some_and(|file| !file.refused.load(Ordering::Relaxed))
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        self.direct.as_ref().map(|file| &file.limit)
    }

    fn read(&self, offset: u64, len: usize) -> StoreFuture<'_> {
        match &self.direct {
            Some(file) => Box::pin(file.read(offset, len)),
            None => self.buffered.read(offset, len),
        }
    }
}

/// A file that is open twice: for direct reads, and for what they cannot do.
#[derive(Debug)]
struct DirectFile {
    buffered: Arc<FileStore>,
    file: File,
    block: NonZeroU32,
    /// Set when the file system refuses a read after opening; all further reads go through the cache.
    refused: AtomicBool,
    limit: Arc<ReadLimit>,
    /// Buffers that no read uses at the moment, at most as many as there were reads at once.
    buffers: Mutex<Vec<Vec<u8>>>,
}

impl DirectFile {
    /// Opens the file for direct reads. Fails if a first block cannot be read directly.
    fn open(buffered: &Arc<FileStore>, path: &Path, depth: usize) -> io::Result<DirectFile> {
        let (file, block) = open_direct(buffered.file(), path)?;
        let file = DirectFile::of(buffered.clone(), file, block, depth);
        file.read_piece(&mut Vec::new(), 0, 1, &mut Vec::new())?;
        Ok(file)
    }

    fn of(buffered: Arc<FileStore>, file: File, block: NonZeroU32, depth: usize) -> DirectFile {
        let (refused, limit) = (AtomicBool::new(false), ReadLimit::blocking(depth.clamp(1, MOST_DEPTH)));
        DirectFile { buffered, file, block, refused, limit, buffers: Mutex::default() }
    }

    /// Reads as [`DirectFile::read_now`] does, once fewer reads are under way than the limit allows.
    async fn read(&self, offset: u64, len: usize) -> Result<Bytes, StoreError> {
        let _permit = self.limit.permit().await;
        let mut buffer = lock(&self.buffers).pop().unwrap_or_default();
        let read = self.read_now(&mut buffer, offset, len);
        lock(&self.buffers).push(buffer);
        read
    }

    /// Exactly `len` bytes from `offset` on. Whatever cannot be read directly is read through the cache,
    /// which gives the error too.
    fn read_now(&self, buffer: &mut Vec<u8>, offset: u64, len: usize) -> Result<Bytes, StoreError> {
        let lies_within = offset.checked_add(len as u64).is_some_and(|end| end <= self.buffered.len());
        if !lies_within || self.refused.load(Ordering::Relaxed) {
            return self.buffered.read_now(offset, len);
        }
        let mut bytes = Vec::new();
        reserve(&mut bytes, len).map_err(|error| self.buffered.failed(offset, len, error))?;
        while bytes.len() < len {
            let missing = len - bytes.len();
            match self.read_piece(buffer, offset + bytes.len() as u64, missing.min(MOST_BYTES), &mut bytes) {
                Ok(()) => {}
                Err(error) => {
                    self.note(&error);
                    return self.buffered.read_now(offset, len);
                }
            }
        }
        Ok(bytes.into())
    }

    /// Appends `len` bytes from `offset` on to `bytes`, by one read of the blocks that they lie in.
    fn read_piece(
        &self,
        buffer: &mut Vec<u8>,
        offset: u64,
        len: usize,
        bytes: &mut Vec<u8>,
    ) -> io::Result<()> {
        let block = self.block.get() as usize;
        let lead = (offset % block as u64) as usize;
        let wide = (lead + len).next_multiple_of(block);
        let place = aligned(buffer, wide, block)?;
        let count = loop {
            match read_some_at(&self.file, place, offset - lead as u64) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                result => break result?,
            }
        };
        // The last block of a file ends where the file does. Any other read is whole, or the cache is asked.
        let read = place[..count].get(lead..lead + len).ok_or(io::ErrorKind::UnexpectedEof)?;
        bytes.extend_from_slice(read);
        Ok(())
    }

    fn note(&self, error: &io::Error) {
        let refusals = [io::ErrorKind::InvalidInput, io::ErrorKind::Unsupported];
        if refusals.contains(&error.kind()) && !self.refused.swap(true, Ordering::Relaxed) {
            tracing::info!("{}: no direct reads any more: {error}", self.buffered.name());
        }
    }
}

/// The first `len` bytes of a buffer that begin at a multiple of `block` in memory; the buffer grows if it
/// must.
fn aligned(buffer: &mut Vec<u8>, len: usize, block: usize) -> io::Result<&mut [u8]> {
    if buffer.len() < len + block {
        *buffer = vec![0; len + block];
    }
    let first = buffer.as_ptr().align_offset(block);
    buffer
        .get_mut(first..first.saturating_add(len))
        .ok_or_else(|| io::Error::other("memory cannot be aligned"))
}

/// The file opened once more, for direct reads, and the block that they take.
#[cfg(target_os = "linux")]
fn open_direct(buffered: &File, path: &Path) -> io::Result<(File, NonZeroU32)> {
    use std::os::unix::fs::{MetadataExt, OpenOptionsExt};

    let flags = rustix::fs::OFlags::DIRECT.bits().cast_signed();
    let file = File::options().read(true).custom_flags(flags).open(path)?;
    let [ours, theirs] = [file.metadata()?, buffered.metadata()?].map(|m| (m.dev(), m.ino()));
    if ours != theirs {
        return Err(io::Error::other("the file was replaced while it was opened"));
    }
    let block = stated_block(&file).unwrap_or(0).max(LEAST_BLOCK);
    let block =
        NonZeroU32::new(block).filter(|block| block.is_power_of_two() && block.get() as usize <= MOST_BYTES);
    Ok((file, block.ok_or(io::ErrorKind::Unsupported)?))
}

/// The alignment that the file system states for direct reads, 0 if it allows none, or `None` if it states
/// nothing.
#[cfg(target_os = "linux")]
fn stated_block(file: &File) -> Option<u32> {
    use rustix::fs::{AtFlags, StatxFlags, statx};

    let stated = statx(file, c"", AtFlags::EMPTY_PATH, StatxFlags::DIOALIGN).ok()?;
    let known = stated.stx_mask & StatxFlags::DIOALIGN.bits() != 0;
    known.then(|| stated.stx_dio_offset_align.max(stated.stx_dio_mem_align))
}

#[cfg(not(target_os = "linux"))]
fn open_direct(_: &File, _: &Path) -> io::Result<(File, NonZeroU32)> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_begin_at_a_block_and_are_kept() {
        let mut buffer = Vec::new();
        for (len, block) in [(4096, 4096), (8192, 4096), (4096, 4096), (65536, 16384)] {
            let place = aligned(&mut buffer, len, block).unwrap();
            assert_eq!((place.len(), place.as_ptr().align_offset(block)), (len, 0));
        }
        assert_eq!(buffer.len(), 65536 + 16384);
    }

    /// What some file systems do: opening and the first read succeed, a later read is refused.
    #[test]
    fn a_refusal_after_opening_leads_to_buffered_reads() {
        let dir = tempfile::tempdir().unwrap();
        let [path, other] = ["bytes", "other"].map(|name| dir.path().join(name));
        let bytes: Vec<u8> = (0..10_000u32).map(|n| (n / 7) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        std::fs::write(&other, vec![255; 10_000]).unwrap();
        let (buffered, file) = (Arc::new(FileStore::open(&path).unwrap()), File::open(&other).unwrap());
        let block = NonZeroU32::new(LEAST_BLOCK).unwrap();
        let file = DirectFile::of(buffered, file, block, 1);
        let read = || pollster::block_on(file.read(5000, 3000)).unwrap();
        assert_eq!(read(), vec![255; 3000], "read directly: from the other file, here");
        file.note(&io::ErrorKind::UnexpectedEof.into());
        assert_eq!(read(), vec![255; 3000]);
        file.note(&io::ErrorKind::InvalidInput.into());
        assert_eq!(read(), bytes[5000..8000]);
    }
}
