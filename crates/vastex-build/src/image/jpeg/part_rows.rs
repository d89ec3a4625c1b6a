//! One JPEG strip of a TIFF file, row by row as it is decoded: a strip may be all of an image, however large.
//!
//! The rows are those of [`super::part`], which decodes a strip at once. Streams that must be decoded whole
//! before any row is there, progressive ones and those of several scans, are left to it.

use std::io::{self, BufRead, Chain, Cursor, Read};

use mozjpeg::decompress::Decompress;

use super::Movable;
use super::errors::{guarded, handlers};
use super::header::{self, JpegHeader};
use super::part::{check, color_space, with_header};

/// Bytes that may stand before the scan: tables, and what programs add of their own.
const MOST_HEAD_BYTES: usize = 16 << 20;
const START: [u8; 2] = [0xff, 0xd8];
const SCAN: u8 = 0xda;
const END: u8 = 0xd9;

/// What a stream is expected to be.
#[derive(Clone, Copy, Debug)]
pub(in crate::image) struct PartShape {
    /// Columns, and rows that are wanted.
    pub(in crate::image) size: [u32; 2],
    /// Rows that it has at most.
    pub(in crate::image) most_rows: u32,
    pub(in crate::image) channels: u8,
    /// True if three channels are YCbCr, where the stream does not say.
    pub(in crate::image) is_ycbcr: bool,
}

/// The rows of a stream, of which three channels become RGB.
pub(in crate::image) struct PartRows<R> {
    /// `None` once it failed.
    decoder: Option<Movable<Chain<Cursor<Vec<u8>>, R>>>,
    /// The row that is given out, and how many of its bytes were.
    row: Vec<u8>,
    given: usize,
    /// Rows that are still to be decoded.
    left: u32,
}

/// The head of a stream as the decoder takes it: up to the data of its first scan. Else what is wrong.
fn head_of(
    tables: &[u8],
    stored: &mut impl BufRead,
    shape: &PartShape,
) -> Result<(Vec<u8>, JpegHeader), String> {
    let head = copy_head(stored).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => "it ends before its picture does".to_owned(),
        _ => error.to_string(),
    })?;
    let head = with_header(tables, &head, shape.channels == 3, shape.is_ycbcr)?;
    let found = header::read(&mut &head[..]).map_err(|fault| fault.to_string())?;
    Ok((head, found))
}

/// The bytes up to the data of the first scan, as they are stored.
fn copy_head(stored: &mut impl BufRead) -> io::Result<Vec<u8>> {
    let unknown = || io::Error::other("its header makes no sense");
    let mut head = vec![0; 2];
    stored.read_exact(&mut head)?;
    if head != START {
        return Err(unknown());
    }
    loop {
        let marker = next_of_head(stored)?;
        if marker == END {
            return Err(io::Error::other("it ends before any picture"));
        }
        let mut len = [0; 2];
        stored.read_exact(&mut len)?;
        let body = usize::from(u16::from_be_bytes(len)).checked_sub(2).ok_or_else(unknown)?;
        head.extend([0xff, marker]);
        head.extend(len);
        let from = head.len();
        if from + body > MOST_HEAD_BYTES {
            return Err(io::Error::other("more stands before its picture than is read"));
        }
        head.resize(from + body, 0);
        stored.read_exact(&mut head[from..])?;
        if marker == SCAN {
            return Ok(head);
        }
    }
}

/// The next marker, which stands where it must, but for what fills up before it.
fn next_of_head(stored: &mut impl BufRead) -> io::Result<u8> {
    let mut byte = [0];
    stored.read_exact(&mut byte)?;
    let is_marker = byte == [0xff];
    while byte == [0xff] {
        stored.read_exact(&mut byte)?;
    }
    match byte {
        [0] => Err(io::Error::other("its header makes no sense")),
        [marker] if is_marker => Ok(marker),
        _ => Err(io::Error::other("its header makes no sense")),
    }
}

/// Returns true if the rows of a stream come while it is decoded. What makes no sense has none.
pub(in crate::image) fn has_rows(tables: &[u8], stored: &mut impl BufRead, shape: &PartShape) -> bool {
    let found = head_of(tables, stored, shape);
    found.is_ok_and(|(_, found)| found.interleaved && !found.progressive)
}

impl<R: BufRead + Send> PartRows<R> {
    /// Begins to decode a stream; else says what is wrong with it.
    pub(in crate::image) fn new(
        tables: &[u8],
        mut stored: R,
        shape: &PartShape,
    ) -> Result<PartRows<R>, String> {
        let (head, found) = head_of(tables, &mut stored, shape)?;
        check(&found, shape.size, shape.most_rows, shape.channels)?;
        if found.progressive || !found.interleaved {
            return Err("it is a JPEG that must be decoded whole, unlike the strips before it".into());
        }
        let source = Cursor::new(head).chain(stored);
        let color = color_space(shape.channels);
        let started = guarded(|| Decompress::with_err(handlers()).from_reader(source)?.to_colorspace(color))?;
        Ok(PartRows {
            decoder: Some(Movable(Box::new(started))),
            row: vec![0; shape.size[0] as usize * usize::from(shape.channels)],
            given: shape.size[0] as usize * usize::from(shape.channels),
            left: shape.size[1],
        })
    }

    fn next_row(&mut self) -> Result<(), String> {
        let Some(Movable(mut decoder)) = self.decoder.take() else {
            return Err("it cannot be decoded".into());
        };
        let row = &mut self.row;
        let decoder = guarded(move || {
            decoder.read_scanlines_into::<u8>(row)?;
            Ok(decoder)
        })?;
        self.decoder = Some(Movable(decoder));
        (self.given, self.left) = (0, self.left - 1);
        Ok(())
    }
}

impl<R: BufRead + Send> Read for PartRows<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if bytes.is_empty() {
            return Ok(0);
        }
        if self.given == self.row.len() {
            if self.left == 0 {
                return Ok(0);
            }
            self.next_row().map_err(|why| io::Error::new(io::ErrorKind::InvalidData, why))?;
        }
        let count = bytes.len().min(self.row.len() - self.given);
        bytes[..count].copy_from_slice(&self.row[self.given..][..count]);
        self.given += count;
        Ok(count)
    }
}
