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
//! a program open, the others are decoded whole when they begin.
//!
//! Rows are made in batches in which the same pieces lie, which are decoded piece by piece, several pieces at
//! once where there is help.

use std::collections::VecDeque;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::ahead::{Ahead, Helpers};
use super::file::open_file;
use super::grids::{common, in_tile, widen};
use super::open_files::OpenFiles;
use super::picture::files_of_texels;
use super::pieces::{Decoded, Piece, hold_too_many, memory};
use crate::image::{ImageHeader, InputFault, Notice, Profile, RowReader};

/// The first line.
const MAGIC: &str = "vastex mosaic";
/// Bytes that the text may have.
const MAX_TEXT: u64 = 16 << 20;
/// Columns, and rows, that a grid may have.
const MAX_GRID: u32 = 1 << 16;
/// Bytes of the rows that are made at once, but one row at least, and rows at most.
const BATCH_BYTES: usize = 1 << 20;
const BATCH_ROWS: usize = 64;

/// The picture that the pieces make.
pub(super) struct MosaicReader {
    header: ImageHeader,
    pieces: Vec<Piece>,
    /// Pieces that begin in rows to come, by their numbers; the last begins first.
    waiting: Vec<usize>,
    /// Pieces of the batch that was planned last, by their numbers, in the order of the text.
    present: Vec<usize>,
    /// The first row that is in no batch yet, and rows of the batch that was planned last.
    planned: u32,
    planned_rows: u32,
    /// Batches that were planned and not made, in their order.
    batches: VecDeque<Batch>,
    /// The pieces of the last batch whose rows nobody was asked for.
    unasked: VecDeque<usize>,
    /// Rows of pieces, in the order of batches, and in each in the order of the text.
    ahead: Ahead<Decoded>,
    /// How many of them nobody has taken.
    away: usize,
    /// Whether all of them must be taken before the next is asked for.
    must_wait: bool,
    /// Rows that were made last, and where the next one begins.
    rows: Vec<u8>,
    next: usize,
    next_row: u32,
    rows_with_gaps: u64,
    /// Whether damaged pieces are taken for what can be made of them.
    tolerates: bool,
    /// As many as pieces may be open at once.
    _open_files: OpenFiles,
}

/// Rows in which the same pieces lie.
struct Batch {
    count: u32,
    /// By their numbers, in the order of the text.
    pieces: Vec<usize>,
}

/// Opens the mosaic that a text file describes, and looks at every piece; nothing where the text is something
/// else.
pub(super) fn open(path: &Path) -> Result<Option<MosaicReader>, InputFault> {
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
            Some(("grid", pattern)) => pieces.extend(grid(directory, pattern.trim())?),
            _ => pieces.push(piece(directory, line, number)?),
        }
    }
    MosaicReader::new(pieces).map(Some)
}

/// A line `X Y FILE`.
fn piece(directory: &Path, line: &str, number: usize) -> Result<Piece, InputFault> {
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
    Piece::new(directory.join(name), [x, y])
}

/// The pieces of a grid, as many as there are files.
fn grid(directory: &Path, pattern: &str) -> Result<Vec<Piece>, InputFault> {
    if !pattern.contains("{x}") || !pattern.contains("{y}") {
        let why = format!("has the grid '{pattern}'");
        return Err(InputFault::layout(why, "a pattern holds {x} and {y}, as in tile_{x}_{y}.png"));
    }
    let path = |x: u32, y: u32| {
        directory.join(pattern.replace("{x}", &x.to_string()).replace("{y}", &y.to_string()))
    };
    let columns = (0..MAX_GRID).take_while(|&x| path(x, 0).is_file()).count() as u32;
    let rows = (0..MAX_GRID).take_while(|&y| path(0, y).is_file()).count() as u32;
    if columns == 0 {
        let why = format!("has the grid '{pattern}', but there is no {}", path(0, 0).display());
        return Err(InputFault::layout(why, "number columns and rows from 0"));
    }
    let mut pieces: Vec<Piece> = Vec::new();
    let mut at = [0u32; 2];
    for y in 0..rows {
        at[0] = 0;
        for x in 0..columns {
            let piece = Piece::new(path(x, y), at)?;
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
        header.profile = profile(&mut header.notices, &pieces);
        let open_files = hold_too_many(&mut pieces, OpenFiles::reserve);
        // Decoded rows of a piece, and the batch that is made of them.
        let batch = batch_rows(&header) * header.row_bytes();
        let row = pieces.iter().map(|piece| piece.header.row_bytes()).max().unwrap_or(0);
        let turn = (batch_rows(&header) * row) as u64;
        header.memory = memory(&pieces).saturating_add(batch as u64).saturating_add(turn);
        for piece in &pieces {
            for notice in &piece.header.notices {
                if !header.notices.contains(notice) {
                    header.notices.push(notice.clone());
                }
            }
        }
        let mut waiting: Vec<usize> = (0..pieces.len()).collect();
        waiting.sort_by_key(|&piece| std::cmp::Reverse(pieces[piece].at[1]));
        // One turn of each piece at a time.
        let ahead = Ahead::new(pieces.len() as u64, turn);
        Ok(MosaicReader {
            header,
            pieces,
            waiting,
            present: Vec::new(),
            planned: 0,
            planned_rows: 0,
            batches: VecDeque::new(),
            unasked: VecDeque::new(),
            ahead,
            away: 0,
            must_wait: false,
            rows: Vec::new(),
            next: 0,
            next_row: 0,
            rows_with_gaps: 0,
            tolerates: false,
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

    /// Plans the next batch, up to where a piece begins or ends; whether there is one. Says whether pieces
    /// begin with it.
    fn plan(&mut self) -> Option<bool> {
        let (pieces, y) = (&self.pieces, self.planned);
        if y == self.header.height {
            return None;
        }
        self.present.retain(|&piece| pieces[piece].rows().contains(&y.into()));
        let mut some_begin = false;
        while let Some(piece) = self.waiting.pop_if(|piece| pieces[*piece].at[1] <= y) {
            let place = self.present.partition_point(|&other| other < piece);
            self.present.insert(place, piece);
            some_begin = true;
        }
        let next = self.waiting.last().map_or(u64::MAX, |&piece| pieces[piece].rows().start);
        let end = self.present.iter().fold(next, |end, &piece| end.min(pieces[piece].rows().end));
        let most = (u64::from(y) + batch_rows(&self.header) as u64).min(self.header.height.into());
        let count = (end.min(most) - u64::from(y)) as u32;
        self.batches.push_back(Batch { count, pieces: self.present.clone() });
        self.unasked.extend(&self.present);
        self.planned += count;
        self.planned_rows = count;
        Some(some_begin)
    }

    /// Gives rows of pieces to whoever decodes them, as many as there is room for. One turn of a piece follows
    /// the other. Where pieces begin, all that were open before have come back, and closed the files that
    /// end: so no more are open than at any one row.
    fn ask(&mut self) {
        while self.ahead.has_room() {
            let Some(&number) = self.unasked.front() else {
                match self.plan() {
                    Some(some_begin) => self.must_wait = some_begin,
                    None => return,
                }
                continue;
            };
            if self.must_wait && self.away > 0 || self.pieces[number].is_away {
                return;
            }
            self.must_wait = false;
            self.unasked.pop_front();
            let (count, first) = (self.planned_rows, self.planned - self.planned_rows);
            let turn = self.pieces[number].turn(number, first, count, self.tolerates);
            self.ahead.push(move || turn.decode());
            self.away += 1;
        }
    }

    /// Makes the next rows.
    fn make_batch(&mut self) -> Result<(), InputFault> {
        self.ask();
        let Some(batch) = self.batches.pop_front() else { return Ok(()) };
        let (texel, row_bytes) = (self.header.format.texel_bytes(), self.header.row_bytes());
        self.rows.clear();
        self.rows.resize(batch.count as usize * row_bytes, 0);
        self.next = 0;
        let mut covered: Vec<[u32; 2]> = Vec::with_capacity(batch.pieces.len());
        for _ in &batch.pieces {
            self.ask();
            let Some(Decoded { number, rows, texels }) = self.ahead.next() else { break };
            self.away -= 1;
            let piece = &mut self.pieces[number];
            piece.take_back(rows);
            let (texels, own) = (texels?, piece.header.format);
            let from_rows = texels.chunks_exact(piece.header.row_bytes());
            for (row, from) in self.rows.chunks_exact_mut(row_bytes).zip(from_rows) {
                let target = &mut row[piece.at[0] as usize * texel..][..piece.header.width as usize * texel];
                for (to, from) in target.chunks_exact_mut(texel).zip(from.chunks_exact(own.texel_bytes())) {
                    widen(to, from, own.sample());
                }
            }
            covered.push([piece.at[0], piece.at[0] + piece.header.width]);
        }
        covered.sort_unstable();
        let reached =
            covered.iter().try_fold(0, |reached, &[start, end]| (start <= reached).then(|| reached.max(end)));
        if reached != Some(self.header.width) {
            self.rows_with_gaps += u64::from(batch.count);
        }
        self.ask();
        Ok(())
    }
}

/// Rows that are made at once, at most.
fn batch_rows(header: &ImageHeader) -> usize {
    (BATCH_BYTES / header.row_bytes()).clamp(1, BATCH_ROWS)
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

impl RowReader for MosaicReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn tolerate(&mut self) {
        self.tolerates = true;
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        self.ahead.memory(pieces)
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.ahead.take_help(helpers);
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        for row in rows.chunks_exact_mut(row_bytes) {
            if self.next == self.rows.len() {
                self.make_batch()?;
            }
            row.copy_from_slice(&self.rows[self.next..self.next + row_bytes]);
            self.next += row_bytes;
            self.next_row += 1;
        }
        if self.next_row == self.header.height && self.rows_with_gaps > 0 {
            self.header.notices.push(Notice::Gaps(std::mem::take(&mut self.rows_with_gaps)));
        }
        Ok(())
    }
}
