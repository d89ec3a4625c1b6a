//! The numbers and names of all compressions of TIFF, and the decoders of those that know nothing of pixels:
//! bytes to as many bytes as a strip or tile has, at once or as they are read.

use std::io::{self, BufRead, Read};

use weezl::decode::Configuration;
use weezl::{BitOrder, LzwStatus};

/// Values of Compression.
pub(crate) const NONE: u64 = 1;
pub(crate) const FAX4: u64 = 4;
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

/// Returns true if strips and tiles are codestreams of JPEG 2000.
pub(crate) fn is_jpeg_2000(compression: u64) -> bool {
    matches!(compression, APERIO_YCBCR | VIPS_JPEG_2000 | APERIO_RGB | JPEG_2000)
}

/// What a compression is called.
pub(crate) fn name(compression: u64) -> String {
    let name = match compression {
        NONE => "none",
        2 | 3 => "fax (Group 3)",
        FAX4 => "fax (Group 4)",
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

/// Returns true if what it compresses can be decoded bit by bit, from the first byte on.
pub(in crate::image::tiff) fn is_stream(compression: u64) -> bool {
    matches!(compression, NONE | LZW | DEFLATE | OLD_DEFLATE | PACKBITS | ZSTD)
}

/// The most bytes that decoding takes which must be kept, of a strip or tile of so many.
pub(in crate::image::tiff) fn window(compression: u64, decoded: u64) -> u64 {
    match compression {
        ZSTD => decoded.min(1 << MOST_WINDOW_LOG),
        _ => 64 << 10,
    }
}

/// A window of Zstandard is memory: none is larger than what libzstd takes by itself.
const MOST_WINDOW_LOG: u32 = 27;

/// What is stored, decoded as it is read; [`is_stream`] says of what that can be. It ends where what is
/// stored does, or says that it does.
pub(in crate::image::tiff) fn reader<'a>(
    compression: u64,
    stored: impl BufRead + Send + 'a,
) -> Result<Box<dyn Read + Send + 'a>, String> {
    Ok(match compression {
        NONE => Box::new(stored),
        DEFLATE | OLD_DEFLATE => Box::new(flate2::bufread::ZlibDecoder::new(stored)),
        ZSTD => {
            let decoder = zstd::stream::read::Decoder::with_buffer(stored);
            let mut decoder = decoder.map_err(|error| error.to_string())?;
            decoder.window_log_max(MOST_WINDOW_LOG).map_err(|error| error.to_string())?;
            Box::new(decoder)
        }
        LZW => Box::new(Lzw::new(stored)),
        PACKBITS => Box::new(PackBits { stored, run: Run::Literal(0) }),
        other => return Err(format!("{} is no such compression", name(other))),
    })
}

/// Decodes `stored` into all of `bytes`; what is stored may have up to `spare` bytes more. Else says what is
/// wrong.
pub(super) fn decode(compression: u64, stored: &[u8], bytes: &mut [u8], spare: usize) -> Result<(), String> {
    let mut decoder = reader(compression, stored)?;
    let filled = fill(&mut *decoder, bytes)
        .map_err(|(filled, error)| after(filled as u64, bytes.len() as u64, &error))?;
    if filled < bytes.len() {
        return Err(too_little(filled as u64, bytes.len() as u64));
    }
    check_end(&mut *decoder, bytes.len() as u64, spare as u64)
}

/// Reads until `bytes` are full or the reader ends. How many there are, beside the error where there is one.
pub(in crate::image::tiff) fn fill(
    reader: &mut dyn Read,
    bytes: &mut [u8],
) -> Result<usize, (usize, io::Error)> {
    let mut filled = 0;
    while filled < bytes.len() {
        match reader.read(&mut bytes[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err((filled, error)),
        }
    }
    Ok(filled)
}

/// Says what is wrong where there are more than `spare` bytes behind the `wanted` ones that were read. An end
/// that is missing, or a checksum that is wrong, harms no texel: libtiff does not look there either.
pub(in crate::image::tiff) fn check_end(
    reader: &mut dyn Read,
    wanted: u64,
    spare: u64,
) -> Result<(), String> {
    let mut rest = reader.take(spare + 1);
    match io::copy(&mut rest, &mut io::sink()) {
        Ok(count) if count > spare => Err(format!("it decodes to more than its {wanted} bytes")),
        _ => Ok(()),
    }
}

/// What is said of data that ends.
pub(in crate::image::tiff) fn too_little(found: u64, wanted: u64) -> String {
    format!("it decodes to {found} bytes of {wanted}")
}

/// What is said of data that makes no sense.
pub(in crate::image::tiff) fn after(filled: u64, wanted: u64, error: &io::Error) -> String {
    format!("after {filled} bytes of {wanted}: {error}")
}

/// LZW as TIFF has it.
struct Lzw<R> {
    stored: R,
    decoder: weezl::decode::Decoder,
    /// What was wrong behind the last bytes that were decoded.
    fault: Option<String>,
}

impl<R: BufRead> Lzw<R> {
    fn new(stored: R) -> Lzw<R> {
        let decoder = Configuration::with_tiff_size_switch(BitOrder::Msb, 8);
        let decoder = decoder.with_yield_on_full_buffer(true).build();
        Lzw { stored, decoder, fault: None }
    }
}

impl<R: BufRead> Read for Lzw<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if bytes.is_empty() {
            return Ok(0);
        }
        while self.fault.is_none() {
            let step = self.decoder.decode_bytes(self.stored.fill_buf()?, bytes);
            self.stored.consume(step.consumed_in);
            self.fault = step.status.err().map(|error| error.to_string());
            if step.consumed_out > 0 {
                return Ok(step.consumed_out);
            }
            // The end, or nothing more of what is stored.
            let goes_on = matches!(step.status, Ok(LzwStatus::Ok)) && step.consumed_in > 0;
            if self.fault.is_none() && !goes_on {
                return Ok(0);
            }
        }
        let why = self.fault.clone().unwrap_or_default();
        Err(io::Error::new(io::ErrorKind::InvalidData, why))
    }
}

/// Bytes, or one byte so many times.
enum Run {
    /// So many bytes follow as they are.
    Literal(usize),
    /// The next byte is repeated.
    Repeated(usize),
}

struct PackBits<R> {
    stored: R,
    /// What is left of the run.
    run: Run,
}

impl<R: BufRead> Read for PackBits<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < bytes.len() {
            let stored = self.stored.fill_buf()?;
            let Some(&next) = stored.first() else { break };
            let room = &mut bytes[filled..];
            match &mut self.run {
                Run::Literal(0) => {
                    self.stored.consume(1);
                    self.run = match next as i8 {
                        // Nothing: padding.
                        -128 => Run::Literal(0),
                        head @ 0.. => Run::Literal(head as usize + 1),
                        head => Run::Repeated(1 + usize::from(head.unsigned_abs())),
                    };
                }
                Run::Literal(left) => {
                    let count = (*left).min(stored.len()).min(room.len());
                    room[..count].copy_from_slice(&stored[..count]);
                    self.stored.consume(count);
                    *left -= count;
                    filled += count;
                }
                Run::Repeated(left) => {
                    let count = (*left).min(room.len());
                    room[..count].fill(next);
                    *left -= count;
                    filled += count;
                    if *left == 0 {
                        self.stored.consume(1);
                        self.run = Run::Literal(0);
                    }
                }
            }
        }
        Ok(filled)
    }
}
