//! JPEG, by rows with libjpeg; progressive files through their coefficients.
//!
//! libjpeg only warns when a file ends early and fills the rest with grey. So its source, [`EndIsError`], fails where
//! the file ends, and the decoder never asks beyond a whole file's end. Damage in the middle is told as a notice,
//! where the decoder sees it. libjpeg's errors unwind: they are caught here.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::rc::Rc;

use mozjpeg::ColorSpace;
use mozjpeg::decompress::{Decompress, DecompressStarted};

use super::jpeg_errors::{Fatal, handlers, take_warnings};
use super::{ImageHeader, PixelFormat, RowReader, buffered, jpeg_header};
use crate::error::{InputFault, near_row};
use crate::notice::Notice;

type Decoder = DecompressStarted<EndIsError<BufReader<File>>>;

enum State {
    /// Nothing is allocated yet.
    Opened(File),
    Decoding(Box<Decoder>),
    /// Read to the end, or failed.
    Done,
}

/// A JPEG file.
pub(super) struct JpegReader {
    header: ImageHeader,
    state: State,
    ended: Rc<Cell<bool>>,
    next_row: u32,
    /// Places where the decoder found the data damaged and went on.
    faults: u32,
}

impl JpegReader {
    pub(super) fn new(file: File) -> Result<JpegReader, InputFault> {
        let mut file = buffered(file);
        let found = jpeg_header::read(&mut file)?;
        let format = match found.sampling.len() {
            1 => PixelFormat::GREY8,
            3 => PixelFormat::RGB8,
            n => {
                return Err(InputFault::Unsupported {
                    what: format!("a JPEG of {n} components (CMYK)"),
                    remedy: "convert it to RGB",
                });
            }
        };
        let mut header = ImageHeader::new(found.width.into(), found.height.into(), format)?;
        header.memory = 64 * header.row_bytes() as u64;
        if found.progressive {
            header.hold_whole_image(found.coefficient_bytes(), "a progressive JPEG");
        } else if !found.interleaved {
            header.hold_whole_image(found.coefficient_bytes(), "a JPEG of several scans");
        }
        header.orientation = found.orientation.unwrap_or(1);
        header.profile = found.profile;
        let mut file = file.into_inner();
        file.rewind()?;
        Ok(JpegReader { header, state: State::Opened(file), ended: Rc::default(), next_row: 0, faults: 0 })
    }

    fn start(&self, file: File) -> io::Result<Box<Decoder>> {
        let source = EndIsError { inner: buffered(file), ended: self.ended.clone() };
        let decoder = Decompress::with_err(handlers()).from_reader(source)?;
        let color = match self.header.format {
            PixelFormat::GREY8 => ColorSpace::JCS_GRAYSCALE,
            _ => ColorSpace::JCS_RGB,
        };
        decoder.to_colorspace(color).map(Box::new)
    }

    /// Reads rows, with libjpeg's unwinding going through.
    fn decode(&mut self, rows: &mut [u8]) -> io::Result<()> {
        let mut decoder = match std::mem::replace(&mut self.state, State::Done) {
            State::Opened(file) => self.start(file)?,
            State::Decoding(decoder) => decoder,
            State::Done => return Err(io::Error::other("read beyond the last row")),
        };
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            decoder.read_scanlines_into::<u8>(row)?;
            self.next_row += 1;
        }
        if self.next_row == self.header.height {
            decoder.finish()
        } else {
            self.state = State::Decoding(decoder);
            Ok(())
        }
    }
}

impl JpegReader {
    /// Once everything is read, says how much of it was damaged.
    fn note_faults(&mut self) {
        if self.faults > 0 && self.next_row == self.header.height {
            self.header.notices.push(Notice::DamagedInPlaces(self.faults));
        }
    }
}

impl RowReader for JpegReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        take_warnings();
        let result = catch_unwind(AssertUnwindSafe(|| self.decode(rows)));
        self.faults = self.faults.saturating_add(take_warnings());
        let place = near_row(self.next_row, self.header.height);
        let why = match result {
            Ok(Ok(())) => {
                self.note_faults();
                return Ok(());
            }
            _ if self.ended.get() => return Err(InputFault::Truncated { place }),
            Ok(Err(e)) => e.to_string(),
            Err(payload) if payload.is::<Fatal>() => "it cannot be decoded".into(),
            Err(payload) => resume_unwind(payload),
        };
        Err(InputFault::Damaged { place, why })
    }
}

/// A source that fails at its end, and remembers that it was asked for more.
struct EndIsError<R> {
    inner: R,
    ended: Rc<Cell<bool>>,
}

impl<R: BufRead> Read for EndIsError<R> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        self.inner.read(buf)
    }
}

impl<R: BufRead> BufRead for EndIsError<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        let buf = self.inner.fill_buf()?;
        if buf.is_empty() {
            self.ended.set(true);
            // Any kind but UnexpectedEof, for which the decoder would make up an end of its own.
            return Err(io::Error::other("the file ends"));
        }
        Ok(buf)
    }

    fn consume(&mut self, bytes: usize) {
        self.inner.consume(bytes);
    }
}
