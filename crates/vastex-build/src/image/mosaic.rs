//! Mosaics: many images laid out in one, as a small text says.
//!
//! ```text
//! vastex mosaic
//! # The place of a piece's first texel, and its file, beside the text.
//! 0 0 west.png
//! 4096 0 east.tif
//! ```
//!
//! or, for pieces of one size whose names tell column and row from 0 on,
//!
//! ```text
//! vastex mosaic
//! grid tile_{x}_{y}.png
//! ```
//!
//! Where pieces overlap, later lines win; where none lies, the picture is transparent, or black without
//! alpha. Only the pieces of the rows that are being read are open; where those are more than the system lets
//! a program open, the others are decoded whole when they begin. Pieces of which all is decoded before their
//! first row can be broken off then, whichever row of the mosaic that is.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::file::open_file;
use super::grids::{common, in_tile, widen};
use super::open_files::OpenFiles;
use super::picture::{files_of_texels, open_file_of_texels};
use crate::image::{Beginning, ConvertedPieces, ImageHeader, InputFault, Notice, Profile, RowReader};

/// The first line.
const MAGIC: &str = "vastex mosaic";
/// Bytes that the text may have.
const MAX_TEXT: u64 = 16 << 20;
/// Columns, and rows, that a grid may have.
const MAX_GRID: u32 = 1 << 16;
/// Rows of a piece that is decoded whole which are decoded at once.
const HELD_ROWS: usize = 64;

/// One image of a mosaic.
struct Piece {
    path: PathBuf,
    at: [u32; 2],
    header: ImageHeader,
    /// True if it is decoded whole when its first row is read, so that no file stays open.
    is_held: bool,
    /// True if all of it is decoded before its first row in any case.
    begins_slowly: bool,
    rows: Option<PieceRows>,
}

/// The rows of a piece that are still to come.
enum PieceRows {
    Open(Box<dyn RowReader>),
    /// All rows, and where the next one begins.
    Held(Vec<u8>, usize),
}

/// The picture that the pieces make.
pub(super) struct MosaicReader {
    header: ImageHeader,
    pieces: Vec<Piece>,
    /// Pieces that begin in rows to come, by their numbers; the last begins first.
    waiting: Vec<usize>,
    /// Pieces of the row at hand, by their numbers, in the order of the text.
    present: Vec<usize>,
    /// A row of a piece.
    row: Vec<u8>,
    next_row: u32,
    rows_with_gaps: u64,
    /// True if damaged pieces are taken for what can be made of them.
    tolerates: bool,
    /// The work before rows in which pieces begin that are decoded whole; `None` without such pieces.
    beginning: Option<Arc<Beginning>>,
    /// As many as pieces may be open at once.
    _open_files: OpenFiles,
}

/// Says before each piece whether the mosaic is still wanted.
pub(super) type GoOn<'a> = &'a dyn Fn() -> ControlFlow<()>;

/// Opens the mosaic that a text file describes, and looks at every piece as long as it is wanted
/// ([`InputFault::BrokenOff`]); `None` if the text is something else.
pub(super) fn open(path: &Path, go_on: GoOn<'_>) -> Result<Option<MosaicReader>, InputFault> {
    let mut bytes = Vec::new();
    open_file(path)?.take(MAX_TEXT + 1).read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    let text = text.trim_start_matches('\u{feff}');
    if text.lines().next().is_none_or(|line| line.trim() != MAGIC) {
        return Ok(None);
    }
    if bytes.len() as u64 > MAX_TEXT {
        return Err(InputFault::layout("is a mosaic of more than 16 MiB of text", "split it"));
    }
    let directory = path.parent().unwrap_or(Path::new(""));
    let mut pieces = Vec::new();
    for (number, line) in (1..).zip(text.lines()).skip(1) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        match line.split_once(char::is_whitespace) {
            Some(("grid", pattern)) => pieces.extend(grid(directory, pattern.trim(), go_on)?),
            _ => pieces.push(piece(directory, line, number, go_on)?),
        }
    }
    MosaicReader::new(pieces).map(Some)
}

/// A line `X Y FILE`.
fn piece(directory: &Path, line: &str, number: usize, go_on: GoOn<'_>) -> Result<Piece, InputFault> {
    let mut words = line.splitn(3, char::is_whitespace);
    let mut place = || words.next()?.parse().ok();
    let (Some(x), Some(y)) = (place(), place()) else {
        let why = format!("has '{line}' in line {number}");
        return Err(InputFault::layout(
            why,
            "a line is 'X Y FILE', with X and Y in texels, or 'grid PATTERN'",
        ));
    };
    let name = words.next().map(str::trim).filter(|name| !name.is_empty());
    let name = name.ok_or_else(|| {
        InputFault::layout(format!("names no file in line {number}"), "a line is 'X Y FILE'")
    })?;
    Piece::new(directory.join(name), [x, y], go_on)
}

/// The pieces of a grid, as many as there are files.
fn grid(directory: &Path, pattern: &str, go_on: GoOn<'_>) -> Result<Vec<Piece>, InputFault> {
    if !pattern.contains("{x}") || !pattern.contains("{y}") {
        let why = format!("has the grid '{pattern}'");
        return Err(InputFault::layout(why, "a pattern holds {x} and {y}, as in tile_{x}_{y}.png"));
    }
    let path = |x: u32, y: u32| {
        directory.join(pattern.replace("{x}", &x.to_string()).replace("{y}", &y.to_string()))
    };
    let is_there = |path: PathBuf| go_on().is_continue() && path.is_file();
    let columns = (0..MAX_GRID).take_while(|&x| is_there(path(x, 0))).count() as u32;
    let rows = (0..MAX_GRID).take_while(|&y| is_there(path(0, y))).count() as u32;
    still_wanted(go_on)?;
    if columns == 0 {
        let why = format!("has the grid '{pattern}', but there is no {}", path(0, 0).display());
        return Err(InputFault::layout(why, "number columns and rows from 0"));
    }
    let mut pieces: Vec<Piece> = Vec::new();
    let mut at = [0u32; 2];
    for y in 0..rows {
        at[0] = 0;
        for x in 0..columns {
            let piece = Piece::new(path(x, y), at, go_on)?;
            let (cell, is_last) =
                (pieces.first().unwrap_or(&piece).size(), [x + 1 == columns, y + 1 == rows]);
            let fits = |axis: usize| {
                piece.size()[axis] == cell[axis] || (is_last[axis] && piece.size()[axis] < cell[axis])
            };
            if !fits(0) || !fits(1) {
                let ([w, h], [cw, ch]) = (piece.size(), cell);
                let why = format!("has {w}x{h} texels in a grid of {cw}x{ch}");
                return Err(in_tile(
                    &piece.path,
                    InputFault::layout(why, "only the last column and row may be smaller"),
                ));
            }
            at[0] = at[0].saturating_add(cell[0]);
            pieces.push(piece);
        }
        at[1] = at[1].saturating_add(pieces[0].size()[1]);
    }
    Ok(pieces)
}

/// Fails where nobody wants the mosaic any more.
fn still_wanted(go_on: GoOn<'_>) -> Result<(), InputFault> {
    if go_on().is_break() { Err(InputFault::BrokenOff) } else { Ok(()) }
}

impl Piece {
    fn new(path: PathBuf, at: [u32; 2], go_on: GoOn<'_>) -> Result<Piece, InputFault> {
        still_wanted(go_on)?;
        let opened = open_file_of_texels(&path).map_err(|fault| in_tile(&path, fault))?;
        let (header, begins_slowly) = (opened.header().clone(), opened.beginning().is_some());
        Ok(Piece { path, at, header, is_held: false, begins_slowly, rows: None })
    }

    fn size(&self) -> [u32; 2] {
        [self.header.width, self.header.height]
    }

    fn rows(&self) -> std::ops::Range<u64> {
        let top = u64::from(self.at[1]);
        top..top + u64::from(self.header.height)
    }

    /// Opens the file, or decodes all of it as long as `beginning` is wanted.
    fn open(&self, tolerates: bool, beginning: Option<&Beginning>) -> Result<PieceRows, InputFault> {
        let mut reader = open_file_of_texels(&self.path)?;
        let kind = |header: &ImageHeader| (header.width, header.height, header.format);
        if kind(reader.header()) != kind(&self.header) {
            return Err(InputFault::layout("was changed while it was read", "build again"));
        }
        if tolerates {
            reader.tolerate();
        }
        beginning.iter().for_each(|beginning| beginning.turn_to(reader.beginning()));
        if !self.is_held {
            return Ok(PieceRows::Open(reader));
        }
        let too_large =
            || InputFault::layout("has more texels than memory holds", "allow more open files (ulimit -n)");
        let len = usize::try_from(self.header.image_bytes()).map_err(|_| too_large())?;
        let mut rows = Vec::new();
        rows.try_reserve_exact(len).map_err(|_| too_large())?;
        rows.resize(len, 0);
        for rows in rows.chunks_mut(HELD_ROWS * self.header.row_bytes()) {
            beginning.map_or(Ok(()), Beginning::check)?;
            reader.read_rows(rows)?;
        }
        Ok(PieceRows::Held(rows, 0))
    }

    /// Fills `row` with the next row; opens the file before the first and closes it after the last.
    fn read(
        &mut self,
        row: &mut [u8],
        is_last: bool,
        (tolerates, beginning): (bool, Option<&Beginning>),
    ) -> Result<(), InputFault> {
        let rows = match self.rows.take() {
            Some(rows) => rows,
            None => self.open(tolerates, beginning)?,
        };
        match self.rows.insert(rows) {
            PieceRows::Open(reader) => reader.read_rows(row)?,
            PieceRows::Held(rows, next) => {
                row.copy_from_slice(&rows[*next..*next + row.len()]);
                *next += row.len();
            }
        }
        if is_last {
            self.rows = None;
        }
        Ok(())
    }
}

impl MosaicReader {
    fn new(mut pieces: Vec<Piece>) -> Result<MosaicReader, InputFault> {
        let Some(first) = pieces.first() else {
            return Err(InputFault::layout("is a mosaic without pieces", "add lines 'X Y FILE'"));
        };
        let (mut format, linear) = (first.header.format, first.header.linear);
        let mut size = [0u64; 2];
        for piece in &pieces {
            let own = piece.header.format;
            format = common(format, own).filter(|_| piece.header.linear == linear).ok_or_else(|| {
                let why = format!("holds {own} texels that do not go with the {format} ones before it");
                in_tile(&piece.path, InputFault::layout(why, "convert all pieces to one kind"))
            })?;
            size =
                [0, 1].map(|axis| size[axis].max(u64::from(piece.at[axis]) + u64::from(piece.size()[axis])));
        }
        let mut header = ImageHeader::new(size[0], size[1], format)?;
        header.linear = linear;
        let converted = pieces.iter().map(|piece| piece.header.converted.as_slice());
        (header.converted, header.converted_pieces) = ConvertedPieces::of(converted);
        // Where pieces do not agree, all texels have data.
        header.nodata = first
            .header
            .nodata
            .filter(|value| pieces.iter().all(|piece| piece.header.nodata == Some(*value)));
        header.profile = profile(&mut header.notices, &pieces);
        let open_files = hold_too_many(&mut pieces, OpenFiles::reserve);
        header.memory = memory(&pieces);
        for piece in &pieces {
            for notice in &piece.header.notices {
                if !header.notices.contains(notice) {
                    header.notices.push(notice.clone());
                }
            }
        }
        let mut waiting: Vec<usize> = (0..pieces.len()).collect();
        waiting.sort_by_key(|&piece| std::cmp::Reverse(pieces[piece].at[1]));
        let (present, row) = (Vec::new(), Vec::new());
        let begins_slowly = pieces.iter().any(|piece| piece.begins_slowly || piece.is_held);
        Ok(MosaicReader {
            header,
            pieces,
            waiting,
            present,
            row,
            next_row: 0,
            rows_with_gaps: 0,
            tolerates: false,
            beginning: begins_slowly.then(|| Arc::new(Beginning::of_pieces())),
            _open_files: open_files,
        })
    }

    /// The text that describes the mosaic, and all files of its pieces.
    pub(super) fn files(&self, text: &Path) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> =
            self.pieces.iter().flat_map(|piece| files_of_texels(&piece.path)).collect();
        files.sort_unstable();
        files.dedup();
        files.insert(0, text.to_owned());
        files
    }

    /// Finds the pieces of the next row.
    fn find_present(&mut self) {
        let (pieces, y) = (&self.pieces, self.next_row);
        self.present.retain(|&piece| pieces[piece].rows().contains(&y.into()));
        while let Some(piece) = self.waiting.pop_if(|piece| pieces[*piece].at[1] <= y) {
            let place = self.present.partition_point(|&other| other < piece);
            self.present.insert(place, piece);
        }
    }

    fn read_row(&mut self, row: &mut [u8]) -> Result<(), InputFault> {
        row.fill(0);
        self.find_present();
        let (texel, y) = (self.header.format.texel_bytes(), u64::from(self.next_row));
        let mut covered: Vec<[u32; 2]> = Vec::new();
        let beginning = self.beginning.as_deref();
        beginning.map_or(Ok(()), Beginning::check)?;
        for &number in &self.present {
            let piece = &mut self.pieces[number];
            self.row.resize(piece.header.row_bytes(), 0);
            let is_last = y + 1 == piece.rows().end;
            piece
                .read(&mut self.row, is_last, (self.tolerates, beginning))
                .map_err(|fault| in_tile(&piece.path, fault))?;
            let own = piece.header.format;
            let target = &mut row[piece.at[0] as usize * texel..][..piece.header.width as usize * texel];
            for (to, from) in target.chunks_exact_mut(texel).zip(self.row.chunks_exact(own.texel_bytes())) {
                widen(to, from, own.sample());
            }
            covered.push([piece.at[0], piece.at[0] + piece.header.width]);
        }
        covered.sort_unstable();
        let reached =
            covered.iter().try_fold(0, |reached, &[start, end]| (start <= reached).then(|| reached.max(end)));
        self.rows_with_gaps += u64::from(reached != Some(self.header.width));
        self.next_row += 1;
        Ok(())
    }
}

/// What all pieces say of their colours; nothing, and a notice, where they do not agree.
fn profile(notices: &mut Vec<Notice>, pieces: &[Piece]) -> Option<Profile> {
    let mut profiles = pieces.iter().map(|piece| &piece.header.profile);
    let first = profiles.next()?;
    if profiles.all(|profile| profile == first) {
        return first.clone();
    }
    let name = "of a mosaic's piece".into();
    notices.push(Notice::ProfileIgnored { name, why: "other pieces have another or none" });
    None
}

/// Decides which pieces are held whole, since there may not be as many files open at once as there are pieces
/// in a row; `reserve` says how many of those that would be wanted there may be.
fn hold_too_many(pieces: &mut [Piece], reserve: impl FnOnce(usize) -> OpenFiles) -> OpenFiles {
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
fn memory(pieces: &[Piece]) -> u64 {
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

impl RowReader for MosaicReader {
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
        rows.chunks_exact_mut(self.header.row_bytes()).try_for_each(|row| self.read_row(row))?;
        if self.next_row == self.header.height && self.rows_with_gaps > 0 {
            self.header.notices.push(Notice::Gaps(std::mem::take(&mut self.rows_with_gaps)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::PixelFormat;

    fn piece(at: [u32; 2], size: [u64; 2]) -> Piece {
        let header = ImageHeader::new(size[0], size[1], PixelFormat::RGB8).unwrap();
        Piece { path: PathBuf::new(), at, header, is_held: false, begins_slowly: false, rows: None }
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
