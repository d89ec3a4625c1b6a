//! An image file, decoded into memory.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use super::MemoryImage;
use crate::build::error::BuildError;
use crate::image::{Helpers, in_srgb, open};
use crate::progress::Progress;
use crate::threads;

/// Bytes of the rows that are decoded at once.
const ROWS_BYTES: usize = 1 << 20;
/// Pieces of an image that each thread decodes ahead.
const PIECES: usize = 2;

/// How an image is decoded into memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodeOptions {
    /// Bytes that it may take, with all levels: of a larger image every texel stands for four, sixteen and so on.
    pub limit: u64,
    /// Bytes that its reader may take besides, as progressive JPEGs and pictures that are stored turned do.
    pub memory_limit: u64,
    /// Whether its left and right edges are neighbours.
    pub wraps: bool,
    /// Threads that help to decode what is stored in pieces; 0: one for each core.
    pub threads: usize,
}

impl Default for DecodeOptions {
    /// 1 GiB each.
    fn default() -> DecodeOptions {
        DecodeOptions { limit: 1 << 30, memory_limit: 1 << 30, wraps: false, threads: 0 }
    }
}

/// Decodes an image into memory: all of it, or as large as it may be.
///
/// `begun` is given the image before any of its rows is there, for programs that show it as it grows. `progress` hears of
/// its rows, with 0 for what is written, and may stop it. Fails where [`crate::build()`] would, and where the reader alone
/// would take more than [`DecodeOptions::memory_limit`].
pub fn decode(
    path: &Path,
    options: &DecodeOptions,
    progress: &dyn Progress,
    begun: impl FnOnce(&Arc<MemoryImage>),
) -> Result<Arc<MemoryImage>, BuildError> {
    let at_path = |fault| BuildError::Input { path: path.into(), fault };
    let mut reader = in_srgb(open(path).map_err(at_path)?);
    let header = reader.header().clone();
    header.notices.iter().for_each(|notice| progress.note(path, notice));
    if header.memory > options.memory_limit {
        let remedy = "convert it to a TIFF of many strips or of tiles, stored upright";
        let (needed, limit) = (header.memory, options.memory_limit);
        return Err(BuildError::Memory { path: path.into(), needed, limit, remedy });
    }
    let factor = MemoryImage::factor_within(&header, options.limit);
    let image = Arc::new(MemoryImage::new(&header, factor, options.wraps)?);
    begun(&image);
    let pool = Arc::new(threads::pool(options.threads)?);
    let pieces = PIECES * pool.current_num_threads();
    reader.take_help(&Helpers::new(pool, pieces));
    let row = header.row_bytes();
    let together = (ROWS_BYTES / row).clamp(1, header.height as usize);
    let mut rows = vec![0; together * row];
    let mut done = 0;
    while done < header.height {
        if progress.advance(done.into(), header.height.into(), 0) == ControlFlow::Break(()) {
            return Err(BuildError::Cancelled);
        }
        let count = (header.height - done).min(together as u32);
        let rows = &mut rows[..count as usize * row];
        reader.read_rows(rows).map_err(at_path)?;
        image.push(rows);
        done += count;
    }
    match progress.advance(done.into(), done.into(), 0) {
        ControlFlow::Break(()) => Err(BuildError::Cancelled),
        ControlFlow::Continue(()) => Ok(image),
    }
}
