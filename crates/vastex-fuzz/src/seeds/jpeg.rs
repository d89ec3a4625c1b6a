//! JPEG streams, as files of their own and in the tiles of TIFF files.

use anyhow::Result;
use mozjpeg::{ColorSpace, Compress};

use super::grainy;

/// A JPEG image of one or three channels.
pub(super) fn jpeg(size: [u32; 2], channels: u32, is_progressive: bool) -> Result<Vec<u8>> {
    let color = if channels == 1 { ColorSpace::JCS_GRAYSCALE } else { ColorSpace::JCS_RGB };
    let mut compress = Compress::new(color);
    compress.set_size(size[0] as usize, size[1] as usize);
    if is_progressive {
        compress.set_progressive_mode();
    } else {
        compress.set_fastest_defaults();
        compress.set_optimize_scans(false);
    }
    let mut started = compress.start_compress(Vec::new())?;
    let row = size[0] * channels;
    started.write_scanlines(&grainy(row as usize, (row * size[1]) as usize))?;
    Ok(started.finish()?)
}
