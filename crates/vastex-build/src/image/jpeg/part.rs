//! One JPEG in memory: a strip or tile of a TIFF file, with the tables that all of them share.
//!
//! A stream may say what its colours are, by a marker of Adobe's or JFIF's; where it does not, the file
//! around it does. Guesses by the numbers of components, which libjpeg would make, are wrong for slides. So a
//! new header is put before the scans: the tables, and one marker that says it in any case. libjpeg's
//! arithmetic and its interpolation of colours are those of libjpeg-turbo.

use mozjpeg::ColorSpace;
use mozjpeg::decompress::Decompress;

use super::errors::{guarded, handlers};
use super::header::{self, JpegHeader};

const START_OF_SCAN: [u8; 2] = [0xff, 0xda];

/// Scans of a strip or tile, each of which is decoded in full before any row is there: writers make some ten.
const MOST_SCANS: usize = 200;

/// Decodes the first `size[1]` rows of a stream of `size[0]` columns and as many rows, or up to `most_rows`;
/// else says what is wrong with it. Three channels become RGB; `is_ycbcr` says what they are where the stream
/// does not.
pub(in crate::image) fn decode(
    tables: &[u8],
    stored: &[u8],
    size: [u32; 2],
    most_rows: u32,
    channels: u8,
    is_ycbcr: bool,
) -> Result<Vec<u8>, String> {
    let scans = stored.windows(2).filter(|marker| *marker == START_OF_SCAN).count();
    if scans > MOST_SCANS {
        return Err(format!("it has {scans} scans; at most {MOST_SCANS} are read"));
    }
    let stream = with_header(tables, stored, channels == 3, is_ycbcr)?;
    let found = header::read(&mut &stream[..]).map_err(|fault| fault.to_string())?;
    check(&found, size, most_rows, channels)?;
    let color = color_space(channels);
    guarded(|| {
        let mut decoder = Decompress::with_err(handlers()).from_mem(&stream)?.to_colorspace(color)?;
        let row_bytes = size[0] as usize * usize::from(channels);
        let mut rows = vec![0; row_bytes * size[1] as usize];
        for row in rows.chunks_exact_mut(row_bytes) {
            decoder.read_scanlines_into::<u8>(row)?;
        }
        Ok(rows)
    })
}

/// Says what is wrong with a stream that is to have so many columns and rows, or up to `most_rows`, and so
/// many channels.
pub(super) fn check(found: &JpegHeader, size: [u32; 2], most_rows: u32, channels: u8) -> Result<(), String> {
    let [width, height] = [found.width, found.height].map(u32::from);
    // Some writers round the rows of the last strip up to whole blocks.
    if width != size[0] || height < size[1] || height > most_rows.next_multiple_of(16) {
        return Err(format!("it has {width}x{height} texels where {}x{} are expected", size[0], size[1]));
    }
    if found.sampling.len() != usize::from(channels) {
        let components = found.sampling.len();
        return Err(format!("it has {components} channels where {channels} are expected"));
    }
    Ok(())
}

/// The colours that a stream of so many channels becomes.
pub(super) fn color_space(channels: u8) -> ColorSpace {
    match channels {
        1 => ColorSpace::JCS_GRAYSCALE,
        3 => ColorSpace::JCS_RGB,
        // Four channels as they are, whatever they mean.
        _ => ColorSpace::JCS_CMYK,
    }
}

/// The stream with all tables, and with one marker that says what its colours are.
pub(super) fn with_header(
    tables: &[u8],
    stored: &[u8],
    is_color: bool,
    is_ycbcr: bool,
) -> Result<Vec<u8>, String> {
    const MARKER: [u8; 15] = *b"\xff\xee\0\x0eAdobe\0\x64\0\0\0\0";
    let mut stream = Vec::with_capacity(tables.len() + stored.len() + 20);
    stream.extend([0xff, 0xd8]);
    stream.extend(MARKER);
    let transform = stream.len();
    stream.push(0);
    let mut said = None;
    if !tables.is_empty() {
        copy_segments(tables, &mut stream, &mut said).ok_or("its tables make no sense")?;
    }
    let scans = copy_segments(stored, &mut stream, &mut said).ok_or("its header makes no sense")?;
    stream.extend(scans);
    // Of four channels none is converted, whatever they mean.
    stream[transform] = u8::from(is_color && said.unwrap_or(is_ycbcr));
    Ok(stream)
}

/// Copies the segments that decoding needs, up to the end or to the first scan, which is returned with all
/// that follows. Notes whether colours are said to be YCbCr, by Adobe's marker if there is one.
fn copy_segments<'a>(bytes: &'a [u8], stream: &mut Vec<u8>, is_ycbcr: &mut Option<bool>) -> Option<&'a [u8]> {
    let mut rest = bytes.strip_prefix(&[0xff, 0xd8])?;
    loop {
        match rest {
            [0xff, 0xff, ..] => rest = &rest[1..],
            [] | [0xff, 0xd9, ..] => return Some(&[]),
            [0xff, 0xda, ..] => return Some(rest),
            [0xff, marker, high, low, ..] => {
                let len = 2 + usize::from(u16::from_be_bytes([*high, *low]));
                let (segment, after) = rest.split_at_checked(len).filter(|_| len >= 4)?;
                match (marker, &segment[4..]) {
                    (0xee, [b'A', b'd', b'o', b'b', b'e', .., transform]) if segment.len() == 16 => {
                        *is_ycbcr = Some(*transform == 1);
                    }
                    (0xe0, [b'J', b'F', b'I', b'F', 0, ..]) => *is_ycbcr = is_ycbcr.or(Some(true)),
                    (0xe0..=0xef | 0xfe, _) => {}
                    _ => stream.extend(segment),
                }
                rest = after;
            }
            _ => return None,
        }
    }
}
