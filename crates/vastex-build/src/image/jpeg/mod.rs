//! JPEG, by rows with libjpeg; progressive files through their coefficients, and a first picture of them
//! through the few that come first ([`coarse`]).
//!
//! libjpeg only warns where the data make no sense or end before the picture does, and fills the rest with
//! grey. So a warning among the picture's data is an error, and its source, [`EndIsError`], fails where the
//! file ends; the decoder never asks beyond a whole file's end. Who [tolerates](RowReader::tolerate) damage
//! gets what the decoder makes of it, and a notice. Warnings of the header, of what follows the last row and
//! of a few bytes before the file's end are a notice always. libjpeg's errors unwind: they are caught here.

mod coarse;
mod errors;
mod header;
pub(super) mod part;
pub(super) mod part_rows;

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use mozjpeg::ColorSpace;
use mozjpeg::decompress::{Decompress, DecompressStarted};

use crate::image::fault::near_row;
use crate::image::file::buffered;
use crate::image::inks::rgb_from_inks;
use crate::image::stored_as::StoredAs;
use crate::image::{Beginning, Converted, ImageHeader, InputFault, Notice, PixelFormat, RowReader};
use coarse::CoarseReader;
use errors::{Fatal, handlers, take_stray_bytes, take_warnings};

type Source = EndIsError<BufReader<File>>;

/// The format of rows whose texels are inks: as many samples.
const FOUR_INKS: PixelFormat = PixelFormat::RGBA8;

/// A decoder of a source that other threads may go on with.
struct Movable<R>(Box<DecompressStarted<R>>);

// SAFETY: libjpeg keeps all its state in the object, and that owns all that its pointers lead to: its memory,
// the source, which can be sent, and the handlers, which are functions. It has no thread of its own. Warnings
// are counted by the thread that decodes, which takes them before it returns.
#[allow(unsafe_code, reason = "several layers are read at once, each on a thread")]
unsafe impl<R: Send> Send for Movable<R> {}

enum State {
    /// Nothing is allocated yet.
    Opened(File),
    Decoding(Movable<Source>),
    /// Read to the end, or failed.
    Done,
}

/// A JPEG file.
pub(super) struct JpegReader {
    header: ImageHeader,
    state: State,
    ended: Arc<AtomicBool>,
    next_row: u32,
    /// True if the picture's data may be damaged.
    tolerates: bool,
    /// True if the whole picture is decoded before the first row is given out.
    is_decoded_first: bool,
    beginning: Option<Arc<Beginning>>,
    /// Where its components are inks, what they are.
    inks: Option<Inks>,
    /// Texels per side that are made of a block of 8x8.
    of_eight: u8,
    /// Places where the decoder found the data damaged and went on.
    faults: u32,
    /// Bytes that belong to nothing, as far as they are few.
    stray_bytes: u32,
    /// True if the picture could not be trusted beyond the rows that are given out.
    is_guess: bool,
}

/// How a file stores cyan, magenta, yellow and black.
struct Inks {
    /// True if 0 is all of an ink.
    is_inverted: bool,
    /// A row of them.
    row: Vec<u8>,
}

impl Inks {
    /// The row as red, green and blue.
    fn convert(&mut self, texels: &mut [u8]) {
        let flip = if self.is_inverted { 255 } else { 0 };
        for (rgb, inks) in texels.as_chunks_mut().0.iter_mut().zip(self.row.as_chunks().0) {
            *rgb = rgb_from_inks(inks.map(|ink: u8| ink ^ flip));
        }
    }
}

impl JpegReader {
    pub(super) fn new(file: File) -> Result<JpegReader, InputFault> {
        let mut file = buffered(file);
        let found = header::read(&mut file)?;
        let format = match found.sampling.len() {
            1 => PixelFormat::GREY8,
            3 | 4 => PixelFormat::RGB8,
            n => {
                return Err(InputFault::Unsupported {
                    what: format!("a JPEG of {n} components"),
                    remedy: "convert it to RGB",
                });
            }
        };
        let mut header = ImageHeader::new(found.width.into(), found.height.into(), format)?;
        header.memory = 64 * header.row_bytes() as u64;
        let is_decoded_first = found.progressive || !found.interleaved;
        if found.progressive {
            header.hold_whole_image(found.coefficient_bytes(), "a progressive JPEG");
        } else if !found.interleaved {
            header.hold_whole_image(found.coefficient_bytes(), "a JPEG of several scans");
        }
        header.orientation = found.orientation.unwrap_or(1);
        let has_inks = found.sampling.len() == 4;
        // One of inks says nothing of what a plain formula makes of them.
        header.profile = found.profile.filter(|_| !has_inks);
        header.notices.extend(has_inks.then_some(Notice::InksConverted));
        header.converted.extend(has_inks.then_some(Converted::Inks));
        let mut file = file.into_inner();
        file.rewind()?;
        Ok(JpegReader {
            header,
            state: State::Opened(file),
            ended: Arc::default(),
            next_row: 0,
            tolerates: false,
            is_decoded_first,
            inks: has_inks.then_some(Inks { is_inverted: found.is_of_adobe, row: Vec::new() }),
            beginning: is_decoded_first.then(Arc::default),
            of_eight: 8,
            faults: 0,
            stray_bytes: 0,
            is_guess: false,
        })
    }

    /// A reader of the picture at an eighth of its size, a quarter or a half, with `side` texels or more
    /// along its longer axis, if the picture is larger than that by as much. Of a file of several scans, of
    /// which libjpeg decodes all at any size, there is an eighth, where that has half of `side` or more.
    /// `None` if there is none of them.
    pub(super) fn reduced(mut self, side: u32) -> Option<Box<dyn RowReader>> {
        let longer = self.header.width.max(self.header.height);
        if self.is_decoded_first {
            let State::Opened(file) = self.state else { return None };
            let coarse = (longer / coarse::SHARE >= side / 2).then(|| CoarseReader::new(self.header, file));
            return coarse.flatten().map(|reader| Box::new(reader) as Box<dyn RowReader>);
        }
        let of_eight = [1u8, 2, 4].into_iter().find(|&share| longer / 8 * u32::from(share) >= side)?;
        self.of_eight = of_eight;
        let scaled = |texels: u32| (texels * u32::from(of_eight)).div_ceil(8);
        (self.header.width, self.header.height) = (scaled(self.header.width), scaled(self.header.height));
        self.header.memory = 64 * self.header.row_bytes() as u64;
        Some(Box::new(self))
    }

    /// The same picture with its four inks as libjpeg decodes them; `None` if it has none.
    pub(super) fn of_inks(mut self) -> Option<(JpegReader, StoredAs)> {
        let inks = self.inks.take()?;
        self.header.memory += 64 * u64::from(self.header.width);
        self.header.format = FOUR_INKS;
        self.header.notices.retain(|notice| *notice != Notice::InksConverted);
        self.header.converted.clear();
        let of = match inks.is_inverted {
            true => StoredAs::InvertedInks,
            false => StoredAs::Inks { extra: Arc::default() },
        };
        Some((self, of))
    }

    fn start(&self, file: File) -> io::Result<Box<DecompressStarted<Source>>> {
        let source = EndIsError {
            len: file.metadata()?.len(),
            taken: 0,
            beginning: self.beginning.clone(),
            inner: buffered(file),
            ended: self.ended.clone(),
            // The one kind for which the decoder makes up an end of its own.
            kind: if self.tolerates { io::ErrorKind::UnexpectedEof } else { io::ErrorKind::Other },
        };
        let mut decoder = Decompress::with_err(handlers()).from_reader(source)?;
        decoder.scale(self.of_eight);
        let color = match self.header.format {
            _ if self.inks.is_some() => ColorSpace::JCS_CMYK,
            FOUR_INKS => ColorSpace::JCS_CMYK,
            PixelFormat::GREY8 => ColorSpace::JCS_GRAYSCALE,
            _ => ColorSpace::JCS_RGB,
        };
        decoder.to_colorspace(color).map(Box::new)
    }

    /// Reads rows, with libjpeg's unwinding going through.
    fn decode(&mut self, rows: &mut [u8]) -> io::Result<()> {
        let mut decoder = match std::mem::replace(&mut self.state, State::Done) {
            State::Opened(file) => {
                let decoder = self.start(file)?;
                self.note_warnings(self.is_decoded_first)?;
                decoder
            }
            State::Decoding(Movable(decoder)) => decoder,
            State::Done => return Err(io::Error::other("read beyond the last row")),
        };
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            match &mut self.inks {
                Some(inks) => {
                    inks.row.resize(row.len() / 3 * 4, 0);
                    decoder.read_scanlines_into::<u8>(&mut inks.row)?;
                    inks.convert(row);
                }
                None => {
                    decoder.read_scanlines_into::<u8>(row)?;
                }
            }
            self.note_warnings(true)?;
            self.next_row += 1;
        }
        if self.next_row == self.header.height {
            decoder.finish()
        } else {
            self.state = State::Decoding(Movable(decoder));
            Ok(())
        }
    }
}

impl JpegReader {
    /// Takes the warnings since the last call. Those of the picture's data are an error, unless they are
    /// tolerated.
    fn note_warnings(&mut self, of_picture: bool) -> io::Result<()> {
        let warnings = take_warnings();
        self.faults = self.faults.saturating_add(warnings);
        self.is_guess = of_picture && warnings > 0 && !self.tolerates;
        if self.is_guess { Err(io::Error::other("its data are damaged")) } else { Ok(()) }
    }

    /// Once everything is read, says how much of it was damaged.
    fn note_faults(&mut self) {
        if self.next_row == self.header.height {
            let stray = (self.stray_bytes > 0).then_some(Notice::StrayBytes(self.stray_bytes));
            let damaged = (self.faults > 0).then_some(Notice::DamagedInPlaces(self.faults));
            self.header.notices.extend(stray.into_iter().chain(damaged));
        }
    }
}

impl RowReader for JpegReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn tolerate(&mut self) {
        self.tolerates = true;
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.beginning.clone()
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        take_warnings();
        take_stray_bytes();
        let result = catch_unwind(AssertUnwindSafe(|| self.decode(rows)));
        self.faults = self.faults.saturating_add(take_warnings());
        self.stray_bytes = self.stray_bytes.saturating_add(take_stray_bytes());
        let place = near_row(self.next_row, self.header.height);
        let why = match result {
            Ok(Ok(())) => {
                self.note_faults();
                return Ok(());
            }
            _ if self.ended.load(Ordering::Relaxed) => return Err(InputFault::Truncated { place }),
            _ if self.is_guess => return Err(InputFault::Guess { place }),
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
    ended: Arc<AtomicBool>,
    /// Of the error.
    kind: io::ErrorKind,
    /// Bytes of the file, those that were taken, and who is told of them.
    len: u64,
    taken: u64,
    beginning: Option<Arc<Beginning>>,
}

impl<R: BufRead> Read for EndIsError<R> {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        self.inner.read(buf)
    }
}

impl<R: BufRead> BufRead for EndIsError<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.beginning.as_ref().is_some_and(|beginning| beginning.is_broken_off()) {
            return Err(io::Error::other("it is not wanted any more"));
        }
        let buf = self.inner.fill_buf()?;
        if buf.is_empty() {
            self.ended.store(true, Ordering::Relaxed);
            return Err(io::Error::new(self.kind, "the file ends"));
        }
        if let Some(beginning) = &self.beginning {
            beginning.note(self.taken + buf.len() as u64, self.len);
        }
        Ok(buf)
    }

    fn consume(&mut self, bytes: usize) {
        self.taken += bytes as u64;
        self.inner.consume(bytes);
    }
}
