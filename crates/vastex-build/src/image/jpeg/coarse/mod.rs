//! A JPEG of several scans at an eighth of its size, from the first of them: a quick first picture of what is
//! decoded whole before any row of it is there.
//!
//! A progressive file begins with the DC coefficients of all blocks, which are eight times the means of their
//! 8x8 samples; they are a small part of the file ([`planes`]). Where they lie in one scan, as most programs
//! write them, rows come as that is decoded, a row of MCUs at a time; where components come one after the
//! other, a sample of each block is kept. What comes later in the file is not read: AC coefficients, and the
//! lowest bit of DC coefficients, if the first scan is without it. A sequential file, whose components come
//! one after the other, has the AC coefficients of each block behind its DC coefficient: they are passed
//! over, which takes a fraction of the time of decoding the picture.
//!
//! This is for looking at what is still to be read: [`super::JpegReader`], which is libjpeg, has the last
//! word on every file, and whatever is unusual here is left to it.

mod bits;
mod frame;
mod huffman;
mod planes;
mod stop;

use std::fs::File;
use std::io::{self, BufReader};
use std::sync::Arc;

use crate::image::fault::near_row;
use crate::image::file::buffered;
use crate::image::{Beginning, ImageHeader, InputFault, Notice, RowReader};
use bits::Bits;
use frame::{Frame, Segments};
use planes::{Decoding, Plane, write_row};
use stop::Stop;

/// Texels of the image, across and down, for one of the small picture.
pub(super) const SHARE: u32 = 8;

/// The small picture, by rows.
pub(super) struct CoarseReader {
    header: ImageHeader,
    bits: Bits<BufReader<File>>,
    segments: Segments,
    frame: Frame,
    is_ycbcr: bool,
    /// The scan that holds the rows, or the first that holds some components of them.
    decoding: Decoding,
    planes: Vec<Plane>,
    rows: Rows,
    next_row: u32,
    /// Of what is decoded before the first row, where that is more than a row of MCUs.
    beginning: Option<Arc<Beginning>>,
}

/// Which rows the planes hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rows {
    /// The rows of one row of MCUs, as they are decoded.
    OneOfMcus,
    /// All, once they are decoded.
    AllToDecode,
    All,
}

impl CoarseReader {
    /// The small picture of a file, whose header is `header`. `None` where the file is no JPEG of the
    /// usual kind.
    pub(super) fn new(header: ImageHeader, file: File) -> Option<CoarseReader> {
        CoarseReader::begin(header, file).ok()
    }

    fn begin(mut header: ImageHeader, file: File) -> Result<CoarseReader, Stop> {
        const UNUSUAL: Stop = Stop::Damaged("its header says different things");
        let (mut bits, mut segments) = (Bits::new(buffered(file)), Segments::default());
        let decoding = Decoding::new(segments.next_first_scan(&mut bits)?);
        let frame = segments.frame().ok_or(UNUSUAL)?.clone();
        let is_as_said = frame.size == [header.width, header.height].map(|side| side as usize)
            && frame.components.len() == usize::from(header.format.channels());
        if !is_as_said {
            return Err(UNUSUAL);
        }
        let count = frame.components.len();
        let (rows, mcu_rows) = match decoding.components().count() == count {
            true => (Rows::OneOfMcus, 1),
            false => (Rows::AllToDecode, frame.mcus()[1]),
        };
        let planes: Vec<Plane> = (0..count).map(|n| Plane::new(&frame, n, mcu_rows)).collect();
        (header.width, header.height) = (header.width.div_ceil(SHARE), header.height.div_ceil(SHARE));
        header.memory = planes.iter().map(Plane::bytes).sum();
        header.notices.retain(|notice| !matches!(notice, Notice::WholeImage { .. }));
        let is_ycbcr = segments.is_ycbcr();
        let beginning = (rows == Rows::AllToDecode).then(Arc::default);
        let next_row = 0;
        Ok(CoarseReader {
            header,
            bits,
            segments,
            frame,
            is_ycbcr,
            decoding,
            planes,
            rows,
            next_row,
            beginning,
        })
    }

    /// Decodes what the next row is made of, unless it is there.
    fn decode(&mut self) -> Result<(), Stop> {
        match self.rows {
            Rows::All => Ok(()),
            Rows::OneOfMcus if self.row_of_mcu() > 0 => Ok(()),
            Rows::OneOfMcus => self.decoding.row(&self.frame, &mut self.bits, &mut self.planes, 0),
            Rows::AllToDecode => {
                let mut missing: Vec<usize> = (0..self.frame.components.len()).collect();
                loop {
                    for row in 0..self.decoding.rows(&self.frame) {
                        self.note_beginning(missing.len(), row)?;
                        self.decoding.row(&self.frame, &mut self.bits, &mut self.planes, row)?;
                    }
                    missing.retain(|&component| self.decoding.components().all(|found| found != component));
                    if missing.is_empty() {
                        self.beginning.iter().for_each(|beginning| beginning.note(1, 1));
                        self.rows = Rows::All;
                        return Ok(());
                    }
                    self.decoding = Decoding::new(self.segments.next_first_scan(&mut self.bits)?);
                }
            }
        }
    }

    /// So many components lack a scan, and so many rows of this one's MCUs are decoded. Ends where nobody
    /// wants them any more.
    fn note_beginning(&self, missing: usize, row: usize) -> Result<(), Stop> {
        let Some(beginning) = &self.beginning else { return Ok(()) };
        if beginning.is_broken_off() {
            return Err(Stop::Io(io::Error::other("it is not wanted any more")));
        }
        let (all, rows) = (self.frame.components.len(), self.decoding.rows(&self.frame));
        let done = (all - missing) * rows + self.decoding.components().count().min(missing) * row;
        beginning.note(done as u64, (all * rows) as u64);
        Ok(())
    }

    /// The number of the next row among those of its MCUs.
    fn row_of_mcu(&self) -> usize {
        self.next_row as usize % self.frame.most[1]
    }

    fn next_row(&mut self, texels: &mut [u8]) -> Result<(), Stop> {
        if self.next_row == self.header.height {
            return Err(Stop::Damaged("there are no more rows"));
        }
        self.decode()?;
        let row = match self.rows {
            Rows::OneOfMcus => self.row_of_mcu(),
            _ => self.next_row as usize,
        };
        let rows = self.planes.iter().enumerate().map(|(component, plane)| {
            let [across, down] = self.frame.texels_of_block(component);
            (plane.row(row / down), across)
        });
        write_row(texels, &rows.collect::<Vec<_>>(), self.is_ycbcr);
        self.next_row += 1;
        Ok(())
    }
}

impl RowReader for CoarseReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.beginning.clone()
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            self.next_row(row).map_err(|stop| {
                let place = near_row(self.next_row, self.header.height);
                match stop {
                    Stop::Ended => InputFault::Truncated { place },
                    Stop::Damaged(why) => InputFault::Damaged { place, why: why.into() },
                    Stop::Io(error) => InputFault::Io(error),
                }
            })?;
        }
        Ok(())
    }
}
