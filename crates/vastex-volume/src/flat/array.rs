//! An array in one run of bytes: cut into chunks that are runs, too.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use bytes::Bytes;
use vastex_tiles::read_advice;

use crate::chunks::{Chunk, ChunkFuture, ChunkSource, Presence, PresenceFuture};
use crate::fault::{VANISHED, VolumeError, VolumeFault, damaged};
use crate::values::{DType, swap_bytes};

/// Bytes of a chunk, where that is at least one value.
const CHUNK_BYTES: u64 = 1 << 20;

/// Bytes behind the values of a gzipped file that are inflated to get to its checksum.
const MOST_BEHIND: u64 = 16 << 20;

/// Where an array lies in a file.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Bytes before its first value.
    pub(crate) offset: u64,
    pub(crate) dtype: DType,
    pub(crate) is_big_endian: bool,
    /// Values along each axis, the slowest first.
    pub(crate) shape: Vec<u64>,
}

impl Layout {
    /// Bytes of all values; `None` if that is no number.
    pub(crate) fn bytes(&self) -> Option<u64> {
        let values = self.shape.iter().try_fold(1_u64, |product, side| product.checked_mul(*side));
        values?
            .checked_mul(self.dtype.bytes() as u64)
            .filter(|bytes| bytes.checked_add(self.offset).is_some())
    }

    /// Values of a chunk along each axis: whole layers, rows of them, or parts of rows, so that it is one
    /// run.
    pub(crate) fn chunk(&self) -> Vec<u64> {
        let mut chunk = vec![1; self.shape.len()];
        let mut bytes = self.dtype.bytes() as u64;
        for axis in (0..self.shape.len()).rev() {
            chunk[axis] = (CHUNK_BYTES / bytes).clamp(1, self.shape[axis]);
            bytes = bytes.saturating_mul(self.shape[axis]);
            if chunk[axis] < self.shape[axis] {
                break;
            }
        }
        chunk
    }
}

/// Where the bytes are.
pub(crate) enum Place {
    /// In a file, as they are.
    Plain(PathBuf),
    /// In a gzipped file, which is inflated whole when the first chunk is read.
    Gzip(PathBuf),
}

/// An array in one run.
pub(crate) struct FlatArray {
    place: Place,
    layout: Layout,
    chunk: Vec<u64>,
    strides: Arc<[usize]>,
    inflated: OnceLock<Result<Bytes, VolumeError>>,
}

impl FlatArray {
    /// Of a layout whose bytes are a number.
    pub(crate) fn new(place: Place, layout: Layout) -> FlatArray {
        let mut strides = vec![0; layout.shape.len()];
        let mut stride = layout.dtype.bytes();
        for axis in (0..strides.len()).rev() {
            strides[axis] = stride;
            stride = stride.saturating_mul(layout.shape[axis] as usize);
        }
        let chunk = layout.chunk();
        FlatArray { place, chunk, strides: strides.into(), layout, inflated: OnceLock::new() }
    }

    fn read_now(&self, coords: &[u64]) -> Result<Chunk, VolumeError> {
        let first: Vec<u64> = coords.iter().zip(&self.chunk).map(|(at, side)| at * side).collect();
        let offset: u64 = first.iter().zip(&*self.strides).map(|(at, stride)| at * *stride as u64).sum();
        let sides = (0..first.len()).map(|axis| self.chunk[axis].min(self.layout.shape[axis] - first[axis]));
        let len = sides.product::<u64>() as usize * self.layout.dtype.bytes();
        let (mut bytes, stored) = match &self.place {
            Place::Plain(path) => (read_range(path, self.layout.offset + offset, len)?, len),
            Place::Gzip(path) => {
                // The first chunk takes the whole file.
                let is_first = self.inflated.get().is_none();
                let file = || std::fs::metadata(path).map_or(0, |found| found.len() as usize);
                let stored = if is_first { file() } else { 0 };
                let all = self.inflated.get_or_init(|| inflate(path, &self.layout)).clone()?;
                (all.slice(offset as usize..offset as usize + len), stored)
            }
        };
        if self.layout.is_big_endian && self.layout.dtype.bytes() > 1 {
            let mut turned = bytes.to_vec();
            swap_bytes(&mut turned, self.layout.dtype.bytes());
            bytes = turned.into();
        }
        // A chunk is a run: its values lie as those of the array.
        Ok(Chunk::new(bytes, self.strides.clone(), stored))
    }
}

fn read_range(path: &std::path::Path, offset: u64, len: usize) -> Result<Bytes, VolumeError> {
    let refused = |error: io::Error| {
        let fault = match error.kind() {
            io::ErrorKind::UnexpectedEof => {
                damaged("ends before the values that its header announces; copy it anew")
            }
            io::ErrorKind::NotFound => VolumeFault::Read(VANISHED.into()),
            _ => VolumeFault::Read(error.to_string()),
        };
        fault.at(path.display().to_string())
    };
    let mut file = File::open(path).map_err(refused)?;
    file.seek(SeekFrom::Start(offset)).map_err(refused)?;
    let mut bytes = vec![0; len];
    file.read_exact(&mut bytes).map_err(refused)?;
    Ok(bytes.into())
}

fn inflate(path: &std::path::Path, layout: &Layout) -> Result<Bytes, VolumeError> {
    let at = |fault: VolumeFault| fault.at(path.display().to_string());
    let file = File::open(path).map_err(|error| at(VolumeFault::Read(read_advice(&error))))?;
    let mut stream = flate2::read::MultiGzDecoder::new(io::BufReader::with_capacity(1 << 18, file));
    let wrong = |error: io::Error| at(damaged(format!("cannot be inflated: {error}; copy it anew")));
    let skipped = io::copy(&mut (&mut stream).take(layout.offset), &mut io::sink()).map_err(wrong)?;
    let len = layout.bytes().unwrap_or(u64::MAX);
    let mut bytes = Vec::new();
    (&mut stream).take(len).read_to_end(&mut bytes).map_err(wrong)?;
    // The checksum stands behind the last byte.
    io::copy(&mut stream.take(MOST_BEHIND), &mut io::sink()).map_err(wrong)?;
    match skipped == layout.offset && bytes.len() as u64 == len {
        true => Ok(bytes.into()),
        false => Err(at(damaged("ends before the values that its header announces; copy it anew"))),
    }
}

impl ChunkSource for FlatArray {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(async move { self.read_now(coords).map(Some) })
    }

    fn fill(&self) -> [u8; 8] {
        [0; 8]
    }

    fn presence(&self, _: usize) -> PresenceFuture<'_> {
        Box::pin(async { Ok(Presence::All) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_runs() {
        let layout = |shape: &[u64]| Layout {
            offset: 0,
            dtype: DType::U16,
            is_big_endian: false,
            shape: shape.to_vec(),
        };
        assert_eq!(layout(&[100, 256, 256]).chunk(), [8, 256, 256]);
        assert_eq!(layout(&[3, 5, 4000, 1000]).chunk(), [1, 1, 524, 1000]);
        assert_eq!(layout(&[2, 2_000_000]).chunk(), [1, 524_288]);
        assert_eq!(layout(&[2, 3, 4]).chunk(), [2, 3, 4]);
        assert_eq!(layout(&[1 << 31; 3]).bytes(), None);
    }
}
