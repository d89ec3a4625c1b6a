//! How much memory a build takes at most, how large its buffers may be, and that freed memory is used again.

use super::error::BuildError;
use super::layers::OpenLayer;
use super::pipeline::Job;
use crate::tile::INDEX_BYTES;

/// Has the allocator of GNU/Linux keep freed memory for the tiles that come next, in place of giving it back
/// and asking for it anew, which takes a tenth of the work of a build without compression. From when on it
/// gives memory back, twice as much as the largest block that was freed, follows the program; so one such
/// block is freed here. Each thread keeps 8 MiB at most. Other allocators have rules of their own.
pub(super) fn keep_freed_memory() {
    const LARGEST_BLOCK: usize = 4 << 20;
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST_BLOCK)));
}

/// Makes buffers as small as the limit asks for, with a container of `pages`, and says what a build then
/// takes at most; an error where that is too much all the same. Nothing has been allocated yet.
pub(super) fn fit_memory(
    layers: &[OpenLayer],
    job: &mut Job<'_>,
    pages: u64,
    limit: u64,
) -> Result<u64, BuildError> {
    /// What the program takes that does nothing yet, its code and the stacks of its threads included.
    const PROGRAM_BYTES: u64 = 16 << 20;
    /// What an allocator wastes at most, as a share of what is asked of it.
    const WASTE: u64 = 8;
    let index = pages.saturating_mul(INDEX_BYTES);
    let readers = layers.iter().fold(0u64, |sum, layer| sum.saturating_add(layer.reader.header().memory));
    let fixed = index.saturating_add(readers).saturating_add(PROGRAM_BYTES);
    job.fit(limit.saturating_sub(fixed) / (WASTE + 1) * WASTE);
    let held = job.memory();
    let needed = held.saturating_add(held / WASTE).saturating_add(fixed);
    if needed <= limit {
        return Ok(needed);
    }
    let greediest = layers.iter().max_by_key(|layer| layer.reader.header().memory);
    let path = greediest.map(|layer| layer.path.clone()).unwrap_or_default();
    let remedy = match greediest.filter(|_| readers > limit / 2).map(|layer| layer.reader.header()) {
        None => "the image is too wide or has too many pages; use larger pages, or split it",
        Some(header) if header.tile_directory.is_some() => {
            "a row of its tiles is held at once; make it anew with smaller tiles, or allow more memory"
        }
        Some(_) => {
            "convert it to a TIFF of many strips or of small tiles, stored upright, which can be read by rows, or allow \
             more memory"
        }
    };
    Err(BuildError::Memory { path, needed, limit, remedy })
}
