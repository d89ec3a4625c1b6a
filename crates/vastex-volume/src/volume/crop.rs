//! Writes a region as an array of NumPy, some rows at a time.

use std::io::{self, Write};
use std::ops::ControlFlow;

use super::{Volume, VolumeRegion};
use crate::fault::VolumeError;
use crate::values::npy_header;

/// Bytes of the rows that are read at once, where that is at least one row.
const BAND_BYTES: u64 = 64 << 20;

/// Why a region could not be written.
#[derive(Debug, thiserror::Error)]
pub enum VolumeCropError {
    /// The volume cannot be read, or the region is not in it.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The output cannot be written.
    #[error("cannot be written: {0}")]
    Output(#[source] io::Error),
    /// The caller asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Writes the values of a region as they are stored, as an array of NumPy of the shape (z, y, x),
/// little-endian. `progress` is told how many rows are done, of how many, and may stop it. Takes the memory
/// of 64 MiB of rows and of the chunks that are kept. What is written before an error is of no use.
pub fn crop(
    volume: &Volume,
    region: &VolumeRegion,
    output: &mut dyn Write,
    progress: &mut dyn FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<(), VolumeCropError> {
    volume.check(region)?;
    let [width, height, depth] = region.size;
    let dtype = volume.about.dtype;
    output.write_all(&npy_header(dtype, &[depth, height, width])).map_err(VolumeCropError::Output)?;
    let total = height.saturating_mul(depth);
    let mut done = 0;
    for band in bands(volume, region) {
        if progress(done, total).is_break() {
            return Err(VolumeCropError::Cancelled);
        }
        let values = pollster::block_on(volume.read(&band))?;
        output.write_all(&values).map_err(VolumeCropError::Output)?;
        done += band.size[1] * band.size[2];
    }
    output.flush().map_err(VolumeCropError::Output)
}

/// The region in parts that follow one another in the output: whole layers up to the next layer of chunks
/// where they fit, else rows.
fn bands<'a>(volume: &'a Volume, region: &'a VolumeRegion) -> impl Iterator<Item = VolumeRegion> + 'a {
    let row = region.size[0] * volume.about.dtype.bytes() as u64;
    let rows = (BAND_BYTES / row).max(1);
    let chunk = volume.arrays[region.level].grid.chunk_size();
    let ([at_x, at_y, at_z], [width, height, depth]) = (region.at, region.size);
    let (mut y, mut z) = (at_y, at_z);
    std::iter::from_fn(move || {
        if z == at_z + depth {
            return None;
        }
        let layers = (rows / height).min(chunk[2] - z % chunk[2]).min(at_z + depth - z);
        let (at, size) = match layers {
            0 => ([at_x, y, z], [width, rows.min(at_y + height - y), 1]),
            _ => ([at_x, at_y, z], [width, height, layers]),
        };
        y += size[1];
        if layers > 0 || y == at_y + height {
            (y, z) = (at_y, z + size[2]);
        }
        Some(VolumeRegion { at, size, ..*region })
    })
}
