//! The numbers and names of all compressions of TIFF, and the decoders of those that know nothing of pixels:
//! bytes to as many bytes as a strip or tile has.

use std::io::Read;

use weezl::BitOrder;
use weezl::decode::Configuration;

/// Values of Compression.
pub(crate) const NONE: u64 = 1;
pub(crate) const LZW: u64 = 5;
pub(crate) const JPEG: u64 = 7;
pub(crate) const DEFLATE: u64 = 8;
pub(crate) const OLD_DEFLATE: u64 = 32946;
pub(crate) const PACKBITS: u64 = 32773;
pub(crate) const APERIO_YCBCR: u64 = 33003;
/// Of libvips, of colours as the file says.
pub(crate) const VIPS_JPEG_2000: u64 = 33004;
pub(crate) const APERIO_RGB: u64 = 33005;
pub(crate) const JPEG_2000: u64 = 34712;
pub(crate) const ZSTD: u64 = 50000;

/// Whether strips and tiles are codestreams of JPEG 2000.
pub(crate) fn is_jpeg_2000(compression: u64) -> bool {
    matches!(compression, APERIO_YCBCR | VIPS_JPEG_2000 | APERIO_RGB | JPEG_2000)
}

/// What a compression is called.
pub(crate) fn name(compression: u64) -> String {
    let name = match compression {
        NONE => "none",
        2..=4 => "fax",
        LZW => "LZW",
        6 => "old JPEG",
        JPEG => "JPEG",
        DEFLATE | OLD_DEFLATE => "Deflate",
        PACKBITS => "PackBits",
        APERIO_YCBCR | VIPS_JPEG_2000 | APERIO_RGB | JPEG_2000 => "JPEG 2000",
        34887 => "LERC",
        34925 => "LZMA",
        ZSTD => "Zstandard",
        50001 => "WebP",
        50002 => "JPEG XL",
        other => return format!("compression {other}"),
    };
    name.into()
}

/// Decodes `stored` into all of `bytes`; what is stored may have up to `spare` bytes more. Else says what is
/// wrong.
pub(super) fn decode(compression: u64, stored: &[u8], bytes: &mut [u8], spare: usize) -> Result<(), String> {
    match compression {
        NONE => stream(stored, bytes, spare),
        DEFLATE | OLD_DEFLATE => stream(flate2::read::ZlibDecoder::new(stored), bytes, spare),
        ZSTD => {
            let decoder = zstd::stream::read::Decoder::with_buffer(stored);
            let mut decoder = decoder.map_err(|error| error.to_string())?;
            // A window is memory: none is larger than what libzstd takes by itself.
            decoder.window_log_max(27).map_err(|error| error.to_string())?;
            stream(decoder, bytes, spare)
        }
        LZW => lzw(stored, bytes, spare),
        PACKBITS => packbits(stored, bytes, spare),
        other => Err(format!("{} is no such compression", name(other))),
    }
}

fn too_little(found: usize, wanted: usize) -> String {
    format!("it decodes to {found} bytes of {wanted}")
}

fn too_much(wanted: usize) -> String {
    format!("it decodes to more than its {wanted} bytes")
}

fn stream(mut decoder: impl Read, bytes: &mut [u8], spare: usize) -> Result<(), String> {
    let mut filled = 0;
    while filled < bytes.len() {
        match decoder.read(&mut bytes[filled..]) {
            Ok(0) => return Err(too_little(filled, bytes.len())),
            Ok(count) => filled += count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(format!("after {filled} bytes of {}: {error}", bytes.len())),
        }
    }
    // An end that is missing, or a checksum that is wrong, harms no texel: libtiff does not look there
    // either.
    let mut rest = decoder.take(spare as u64 + 1);
    match std::io::copy(&mut rest, &mut std::io::sink()) {
        Ok(count) if count > spare as u64 => Err(too_much(bytes.len())),
        _ => Ok(()),
    }
}

fn lzw(stored: &[u8], bytes: &mut [u8], spare: usize) -> Result<(), String> {
    let mut decoder =
        Configuration::with_tiff_size_switch(BitOrder::Msb, 8).with_yield_on_full_buffer(true).build();
    let (mut read, mut filled, mut beyond) = (0, 0, 0);
    let mut sink = vec![0; spare + 1];
    loop {
        let target = if filled < bytes.len() { &mut bytes[filled..] } else { &mut sink[beyond..] };
        if target.is_empty() {
            return Err(too_much(bytes.len()));
        }
        let step = decoder.decode_bytes(&stored[read..], target);
        read += step.consumed_in;
        let is_full = filled == bytes.len();
        if is_full {
            beyond += step.consumed_out;
        } else {
            filled += step.consumed_out;
        }
        match step.status {
            Ok(weezl::LzwStatus::Ok) => {}
            _ if is_full => return if beyond > spare { Err(too_much(bytes.len())) } else { Ok(()) },
            // The end, or nothing more of what is stored.
            Ok(_) if filled < bytes.len() => return Err(too_little(filled, bytes.len())),
            Ok(_) => return Ok(()),
            Err(error) => return Err(format!("after {filled} bytes of {}: {error}", bytes.len())),
        }
    }
}

fn packbits(mut stored: &[u8], bytes: &mut [u8], spare: usize) -> Result<(), String> {
    let wanted = bytes.len();
    let (mut filled, most) = (0, wanted + spare);
    let mut put = |filled: usize, run: &mut dyn Iterator<Item = u8>| {
        bytes.iter_mut().skip(filled).zip(run).for_each(|(to, byte)| *to = byte);
    };
    while let [head, rest @ ..] = stored {
        let head = *head as i8;
        let (run, taken) = match head {
            // Nothing: padding.
            -128 => (0, 0),
            0.. => (head as usize + 1, head as usize + 1),
            _ => (1 + usize::from(head.unsigned_abs()), 1),
        };
        let Some((data, rest)) = rest.split_at_checked(taken) else { break };
        match head {
            -128 => {}
            0.. => put(filled, &mut data.iter().copied()),
            _ => put(filled, &mut std::iter::repeat_n(data[0], run)),
        }
        filled += run;
        stored = rest;
        if filled > most {
            return Err(too_much(wanted));
        }
    }
    if filled < wanted { Err(too_little(filled, wanted)) } else { Ok(()) }
}
