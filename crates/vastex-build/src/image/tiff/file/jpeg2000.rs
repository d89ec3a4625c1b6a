//! Strips and tiles that are JPEG 2000 codestreams, as slide scanners and GDAL write them.
//!
//! The decoder is told what to expect before it allocates anything: the size, the channels and the bits that a
//! codestream says must be those of its directory.

use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};

use crate::image::quiet;
use crate::image::tiff::ycbcr::rgb_from_ycbcr;

/// Tiles that a codestream of one tile of a file may be cut into.
const MOST_TILES: u64 = 1024;

/// Samples of a channel that are decoded at once: what a decoder holds of each is many times as much.
const MOST_TEXELS: u64 = 1 << 24;

/// Decodes a codestream of `size` texels with so many channels of 1 or 2 bytes.
pub(super) fn decode(
    stored: &[u8],
    size: [u32; 2],
    channels: usize,
    bytes: usize,
    is_ycbcr: bool,
) -> Result<Vec<u8>, String> {
    let is_subsampled = check(stored, size, channels, bytes)?;
    let decoded = quiet::catch(|| -> Result<Vec<u8>, String> {
        let settings =
            DecodeSettings { resolve_palette_indices: false, strict: true, target_resolution: None };
        let image = Image::new(stored, &settings).map_err(|error| error.to_string())?;
        let mut context = DecoderContext::default();
        let decoded = image.decode(&mut context).map_err(|error| error.to_string())?;
        let most = if bytes == 1 { 255.0 } else { 65_535.0 };
        let texels = size[0] as usize * size[1] as usize;
        let mut samples = vec![0; texels * channels * bytes];
        for (channel, component) in decoded.components().iter().enumerate() {
            if component.samples().len() != texels {
                return Err("its channels have different sizes".into());
            }
            let targets = samples.chunks_exact_mut(channels * bytes);
            for (to, sample) in targets.zip(component.samples()) {
                let whole = sample.round().clamp(0.0, most) as u16;
                to[channel * bytes..][..bytes].copy_from_slice(&whole.to_le_bytes()[..bytes]);
            }
        }
        Ok(samples)
    });
    let mut samples = decoded.map_err(|_| "it cannot be decoded".to_owned())??;
    // Where colours are subsampled the decoder has made RGB of them.
    if is_ycbcr && !is_subsampled && bytes == 1 {
        rgb_from_ycbcr(&mut samples);
    }
    Ok(samples)
}

/// Looks at the first segment of a codestream; says whether its colours have a lower resolution.
fn check(stored: &[u8], size: [u32; 2], channels: usize, bytes: usize) -> Result<bool, String> {
    let header = stored.strip_prefix(&[0xff, 0x4f, 0xff, 0x51]).and_then(|rest| rest.split_at_checked(38));
    let (header, components) = header.ok_or("it is no JPEG 2000 codestream")?;
    let long = |at: usize| header[at..at + 4].iter().fold(0u64, |n, byte| n << 8 | u64::from(*byte));
    let [width, height] = [long(4).saturating_sub(long(12)), long(8).saturating_sub(long(16))];
    if [width, height] != size.map(u64::from) {
        return Err(format!("it has {width}x{height} texels where {}x{} are expected", size[0], size[1]));
    }
    if width * height > MOST_TEXELS {
        return Err("it is too large to be decoded at once".into());
    }
    let tiles = |axis: usize| {
        let (side, first) = (long(20 + 4 * axis).max(1), long(28 + 4 * axis));
        (long(4 + 4 * axis).saturating_sub(first)).div_ceil(side)
    };
    if tiles(0).saturating_mul(tiles(1)) > MOST_TILES {
        return Err("it is cut into too many tiles".into());
    }
    let count = usize::from(header[36]) << 8 | usize::from(header[37]);
    let components = components.get(..3 * count).unwrap_or_default();
    if count != channels || components.len() != 3 * count {
        return Err(format!("it has {count} channels where {channels} are expected"));
    }
    let bits = |component: &[u8]| u32::from(component[0]) + 1;
    if components.chunks_exact(3).any(|component| bits(component) != 8 * bytes as u32) {
        return Err(format!("its samples have other than {} bits", 8 * bytes));
    }
    Ok(components.chunks_exact(3).any(|component| (component[1], component[2]) != (1, 1)))
}
