//! The pieces of a mosaic: images that are opened when their first row is read, and decoded by rows or whole;
//! how many may be open at once, and what they take. Where they lie, and what is made of them, is `mosaic`'s
//! business.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::PathBuf;

use super::grids::in_tile;
use super::open_files::OpenFiles;
use super::picture::open_file_of_texels;
use crate::image::{ImageHeader, InputFault, RowReader};

/// One image of a mosaic.
pub(super) struct Piece {
    pub(super) path: PathBuf,
    pub(super) at: [u32; 2],
    pub(super) header: ImageHeader,
    /// Whether it is decoded whole when its first row is read, so that no file stays open.
    is_held: bool,
    /// Its rows, between two turns; a thread has them in its own.
    rows: Option<PieceRows>,
    /// Whether a thread decodes rows of it.
    pub(super) is_away: bool,
}

/// The rows of a piece that are still to come.
pub(super) enum PieceRows {
    Open(Box<dyn RowReader>),
    /// All rows, and where the next one begins.
    Held(Vec<u8>, usize),
}

impl Piece {
    pub(super) fn new(path: PathBuf, at: [u32; 2]) -> Result<Piece, InputFault> {
        let opened = open_file_of_texels(&path).map_err(|fault| in_tile(&path, fault))?;
        let header = opened.header().clone();
        Ok(Piece { path, at, header, is_held: false, rows: None, is_away: false })
    }

    /// Width and height.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.header.width, self.header.height]
    }

    /// The rows of the mosaic in which it lies.
    pub(super) fn rows(&self) -> std::ops::Range<u64> {
        let top = u64::from(self.at[1]);
        top..top + u64::from(self.header.height)
    }

    /// What decodes its next rows, as many as `count`. Its rows come back with them.
    pub(super) fn turn(&mut self, number: usize, first_row: u32, count: u32, tolerates: bool) -> Turn {
        self.is_away = true;
        Turn {
            number,
            path: self.path.clone(),
            header: self.header.clone(),
            is_held: self.is_held,
            rows: self.rows.take(),
            count: count as usize,
            is_last: u64::from(first_row) + u64::from(count) == self.rows().end,
            tolerates,
        }
    }

    /// Takes its rows back.
    pub(super) fn take_back(&mut self, rows: Option<PieceRows>) {
        (self.rows, self.is_away) = (rows, false);
    }
}

/// Some rows of a piece that are to be decoded, by any thread.
pub(super) struct Turn {
    number: usize,
    path: PathBuf,
    header: ImageHeader,
    is_held: bool,
    rows: Option<PieceRows>,
    count: usize,
    is_last: bool,
    tolerates: bool,
}

/// What has become of a turn.
pub(super) struct Decoded {
    /// The piece.
    pub(super) number: usize,
    /// Its rows that are still to come.
    pub(super) rows: Option<PieceRows>,
    pub(super) texels: Result<Vec<u8>, InputFault>,
}

impl Turn {
    /// Decodes the rows; opens the file before the first one and closes it after the last.
    pub(super) fn decode(mut self) -> Decoded {
        let mut texels = vec![0; self.count * self.header.row_bytes()];
        let result = self.read(&mut texels);
        if self.is_last {
            self.rows = None;
        }
        let texels = result.map(|()| texels).map_err(|fault| in_tile(&self.path, fault));
        Decoded { number: self.number, rows: self.rows, texels }
    }

    fn read(&mut self, texels: &mut [u8]) -> Result<(), InputFault> {
        let rows = match self.rows.take() {
            Some(rows) => rows,
            None => self.open()?,
        };
        match self.rows.insert(rows) {
            PieceRows::Open(reader) => reader.read_rows(texels),
            PieceRows::Held(rows, next) => {
                texels.copy_from_slice(&rows[*next..*next + texels.len()]);
                *next += texels.len();
                Ok(())
            }
        }
    }

    /// Opens the file, or decodes all of it.
    fn open(&self) -> Result<PieceRows, InputFault> {
        let mut reader = open_file_of_texels(&self.path)?;
        let kind = |header: &ImageHeader| (header.width, header.height, header.format);
        if kind(reader.header()) != kind(&self.header) {
            return Err(InputFault::layout("was changed while it was read", "build again"));
        }
        if self.tolerates {
            reader.tolerate();
        }
        if !self.is_held {
            return Ok(PieceRows::Open(reader));
        }
        let too_large =
            || InputFault::layout("has more texels than memory holds", "allow more open files (ulimit -n)");
        let len = usize::try_from(self.header.image_bytes()).map_err(|_| too_large())?;
        let mut rows = Vec::new();
        rows.try_reserve_exact(len).map_err(|_| too_large())?;
        rows.resize(len, 0);
        reader.read_rows(&mut rows)?;
        Ok(PieceRows::Held(rows, 0))
    }
}

/// Decides which pieces are held whole, since there may not be as many files open at once as there are pieces
/// in a row; `reserve` says how many of those that would be wanted there may be.
pub(super) fn hold_too_many(pieces: &mut [Piece], reserve: impl FnOnce(usize) -> OpenFiles) -> OpenFiles {
    let mut by_row: Vec<usize> = (0..pieces.len()).collect();
    by_row.sort_by_key(|&number| pieces[number].at[1]);
    // Marks the pieces for which there is no room among so many, and says how many are open at once.
    let mut mark = |most: usize| {
        // Where those that are open end; the first to end is popped first.
        let (mut ends, mut wanted) = (BinaryHeap::new(), 0);
        for &number in &by_row {
            let rows = pieces[number].rows();
            while ends.peek().is_some_and(|&Reverse(end)| end <= rows.start) {
                ends.pop();
            }
            pieces[number].is_held = ends.len() >= most;
            if ends.len() < most {
                ends.push(Reverse(rows.end));
                wanted = wanted.max(ends.len());
            }
        }
        wanted
    };
    let open_files = reserve(mark(usize::MAX));
    mark(open_files.count());
    open_files
}

/// Bytes that the pieces of any one row take, at most.
pub(super) fn memory(pieces: &[Piece]) -> u64 {
    let mut events: Vec<(u64, bool, u64)> = Vec::with_capacity(2 * pieces.len());
    for piece in pieces {
        let held = if piece.is_held { piece.header.image_bytes() } else { 0 };
        let bytes =
            piece.header.memory.saturating_add(2 * piece.header.row_bytes() as u64).saturating_add(held);
        // Pieces that end go before those that begin.
        events.extend([(piece.rows().start, true, bytes), (piece.rows().end, false, bytes)]);
    }
    events.sort_unstable();
    let (mut held, mut most) = (0u64, 0);
    for (_, begins, bytes) in events {
        held = if begins { held.saturating_add(bytes) } else { held.saturating_sub(bytes) };
        most = most.max(held);
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::PixelFormat;

    fn piece(at: [u32; 2], size: [u64; 2]) -> Piece {
        let header = ImageHeader::new(size[0], size[1], PixelFormat::RGB8).unwrap();
        Piece { path: PathBuf::new(), at, header, is_held: false, rows: None, is_away: false }
    }

    #[test]
    fn pieces_beyond_the_open_files_are_held_and_counted() {
        let column = |x| [piece([x, 0], [10, 20]), piece([x, 20], [10, 20])];
        let mut pieces: Vec<Piece> = [0, 10, 20].into_iter().flat_map(column).collect();
        let held = |pieces: &[Piece]| pieces.iter().filter(|piece| piece.is_held).count();
        let open_files = hold_too_many(&mut pieces, |wanted| {
            assert_eq!(wanted, 3);
            OpenFiles::for_test(3)
        });
        assert_eq!((open_files.count(), held(&pieces), memory(&pieces)), (3, 0, 3 * 60));
        hold_too_many(&mut pieces, |_| OpenFiles::for_test(1));
        assert_eq!((held(&pieces), memory(&pieces)), (4, 3 * 60 + 2 * 600));
        hold_too_many(&mut pieces, |_| OpenFiles::for_test(0));
        assert_eq!((held(&pieces), memory(&pieces)), (6, 3 * 660));
    }
}
