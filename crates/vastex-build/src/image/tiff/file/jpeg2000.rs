//! Strips and tiles that are JPEG 2000 codestreams, as slide scanners and GDAL write them.
//!
//! The decoder is told what to expect before it allocates anything: the size, the channels and the bits that
//! a codestream says must be those of its directory, and its blocks, precincts and layers such as need no
//! more memory than the texels do.

use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};

use crate::image::quiet;
use crate::image::tiff::ycbcr::rgb_from_ycbcr;

/// Tiles that a codestream of one tile of a file may be cut into.
const MOST_TILES: u64 = 1024;

/// Layers of quality, for each of which a decoder keeps something of every block.
const MOST_LAYERS: u16 = 64;

/// Of the sides of blocks and precincts, at least: 16 texels.
const LEAST_EXPONENT: u8 = 4;

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

/// Looks at the first segment of a codestream; returns true if its colours have a lower resolution.
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
    check_coding(stored, count > 256)
        .ok_or("its headers make no sense, or cut it into pieces that are too small")?;
    Ok(components.chunks_exact(3).any(|component| (component[1], component[2]) != (1, 1)))
}

/// Looks at how a codestream and its tiles are coded: `None` if blocks or precincts are so small, or
/// layers so many, that a decoder would hold many times what it decodes, or if a segment is not whole.
fn check_coding(stored: &[u8], is_of_many: bool) -> Option<()> {
    const SOT: u16 = 0xff90;
    const SOD: u16 = 0xff93;
    const EOC: u16 = 0xffd9;
    const COD: u16 = 0xff52;
    const COC: u16 = 0xff53;
    let short = |at: usize| Some(u16::from_be_bytes(*stored.get(at..)?.first_chunk()?));
    let (mut at, mut end_of_part) = (2, stored.len());
    loop {
        let marker = short(at)?;
        if marker == SOD {
            at = end_of_part;
            if at >= stored.len() {
                return Some(());
            }
            continue;
        }
        if marker == EOC {
            return Some(());
        }
        let length = usize::from(short(at + 2)?);
        let segment = stored.get(at + 4..at + 2 + length.max(2))?;
        match marker {
            SOT => {
                let bytes = u32::from_be_bytes(*segment.get(2..)?.first_chunk()?) as usize;
                end_of_part = if bytes == 0 { stored.len() } else { at.checked_add(bytes)? };
                (end_of_part > at + length).then_some(())?;
            }
            COD => {
                let layers = u16::from_be_bytes([*segment.get(2)?, *segment.get(3)?]);
                (layers <= MOST_LAYERS).then_some(())?;
                check_blocks(*segment.first()?, segment.get(5..)?)?;
            }
            COC => {
                let component = if is_of_many { 2 } else { 1 };
                check_blocks(*segment.get(component)?, segment.get(component + 1..)?)?;
            }
            _ => {}
        }
        at += 2 + length.max(2);
    }
}

/// The style of coding from its number of decompositions on: sides of blocks, and of precincts where `style`
/// says so, as powers of two.
fn check_blocks(style: u8, coding: &[u8]) -> Option<()> {
    let is_fit = |exponent: u8| exponent >= LEAST_EXPONENT;
    let blocks = coding.get(1..3)?.iter().all(|exponent| is_fit((exponent & 15) + 2));
    let precincts = if style & 1 == 1 { coding.get(5..)? } else { &[] };
    let precincts = precincts.iter().all(|sides| is_fit(sides & 15) && is_fit(sides >> 4));
    (blocks && precincts).then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The headers of a codestream of one tile-part: so many layers, sides of blocks and of precincts as
    /// powers of two.
    fn headers(layers: u16, block: u8, precinct: Option<u8>) -> Vec<u8> {
        let style = u8::from(precinct.is_some());
        let sides: Vec<u8> = precinct.into_iter().flat_map(|side| [side << 4 | side; 2]).collect();
        let mut coding = vec![style, 0];
        coding.extend(layers.to_be_bytes());
        coding.extend([0, 1, block - 2, block - 2, 0, 0]);
        coding.extend(sides);
        let mut stream = vec![0xff, 0x4f, 0xff, 0x52];
        stream.extend((coding.len() as u16 + 2).to_be_bytes());
        stream.extend(coding);
        stream.extend([0xff, 0x90, 0, 10, 0, 0, 0, 0, 0, 0, 0, 1, 0xff, 0x93, 1, 2, 3]);
        stream
    }

    #[test]
    fn what_would_take_many_times_its_texels_is_refused_before_it_is_decoded() {
        let fits = |layers, block, precinct| check_coding(&headers(layers, block, precinct), false).is_some();
        assert!(fits(1, 6, None) && fits(64, 4, Some(4)) && fits(5, 6, Some(8)));
        assert!(!fits(65, 6, None) && !fits(1, 3, None) && !fits(1, 6, Some(1)) && !fits(1, 6, Some(3)));
        let whole = headers(1, 6, Some(8));
        let ends = (0..whole.len()).filter(|&end| check_coding(&whole[..end], false).is_some());
        assert!(ends.count() <= 4, "a stream that ends in its headers is refused");
    }
}
