//! Writing a container so that a killed build can be resumed: a partial file under a name that all builds
//! into its place share, and a journal beside it.
//!
//! Resuming appends again every tile that the journal has, in its order, without writing the bytes that are
//! in the partial file already. So the writer reaches the state in which it was after the last of these
//! tiles, and the file becomes the one that an uninterrupted build writes. Every tile is checked; the first
//! tile that is not as it was written ends the taking over. Making the tiles that follow is the builder's
//! business.

use std::collections::HashMap;
use std::io::{Read, Seek};
use std::ops::ControlFlow;
use std::path::Path;

use bytes::Bytes;
use vastex_core::{Description, PagePos};

use super::error::WriteError;
use super::journal::{Head, Journal, Records};
use super::output::TempFile;
use super::tile_head::TileHead;
use super::writer::{ContainerWriter, Destination, WriterOptions, Written};
use crate::container::format::description;
use crate::ground::hash::checksum;
use crate::tile::EncodedTile;

/// Bytes of tiles after which the journal is brought up to date: the most that a resumed build makes anew.
const TILE_BYTES: u64 = 4 << 20;
/// Bytes that wait for the journal at most.
const JOURNAL_BYTES: usize = 1 << 16;

/// What decides the tiles of a build, in addition to its description and writer options.
#[derive(Clone, Copy, Debug, Default)]
pub struct Origin<'a> {
    /// Bytes that differ if the input differs.
    pub input: &'a [u8],
    /// What the builder was asked for: for each option a line with its name, a space and its value. Where
    /// only options differ, the error says which.
    pub options: &'a str,
}

/// What to do with what an interrupted build left, and what to leave if this build is interrupted.
pub enum Left<'a> {
    /// Removes what was left, and leaves nothing unless the process is killed.
    Removed,
    /// Resumes what was left; if the writer is dropped unfinished, what is written stays. The function gets,
    /// from time to time, the number of bytes that have been taken over; `Break` ends with
    /// [`WriteError::Cancelled`] and leaves everything as it was.
    Resumed(&'a mut dyn FnMut(u64) -> ControlFlow<()>),
}

/// Writes one container from the beginning, or resumes where an interrupted writer stopped; the bytes are the
/// same.
///
/// The file appears at its place when it is finished, and not before. Takes the memory of a
/// [`ContainerWriter`].
#[derive(Debug)]
pub struct ResumableWriter {
    // Dropped in this order: first the tiles are written, then the records of them.
    writer: ContainerWriter<TempFile>,
    journal: Journal,
    name: String,
    durable: bool,
    taken_over: u64,
    /// Where the writer was when the journal was last brought up to date.
    journalled: u64,
}

impl ResumableWriter {
    /// Begins a container that [`ResumableWriter::finish`] will put at `path`, replacing what is there, or
    /// resumes it.
    ///
    /// Reads once what is taken over. Fails with [`WriteError::OtherBuild`] if that is of another origin.
    pub fn create(
        path: impl AsRef<Path>,
        description: Description,
        options: WriterOptions,
        origin: Origin<'_>,
        left: Left<'_>,
    ) -> Result<ResumableWriter, WriteError> {
        let name = path.as_ref().display().to_string();
        let failed = WriteError::io(&name);
        let head = head_of(&description, &options, origin);
        let claimed = TempFile::claim(path.as_ref()).map_err(&failed)?;
        let mut out = claimed.ok_or_else(|| WriteError::InUse { name: name.clone() })?;
        let kept = matches!(left, Left::Resumed(_));
        let found = if kept { open_journal(&name, &out, &head)? } else { None };
        let is_new = found.is_none();
        if is_new {
            out.set_keep(false);
        }
        let mut journal = match found {
            Some(journal) => journal,
            None => {
                let path = out.journal_path();
                let shown = path.display().to_string();
                let journal = Journal::create(path, &head).map_err(WriteError::io(&shown))?;
                out.go_on_at(0).map_err(&failed)?;
                journal
            }
        };
        out.rewind().map_err(&failed)?;
        let durable = options.durable;
        let mut writer = ContainerWriter::new(out, name.clone(), description, options)?;
        writer.out_mut().set_keep(kept);
        journal.set_keep(kept);
        let journalled = writer.offset();
        let mut writer = ResumableWriter { writer, journal, name, durable, taken_over: 0, journalled };
        if let Left::Resumed(go_on) = left
            && !is_new
        {
            writer.take_over(go_on)?;
        }
        Ok(writer)
    }

    /// How many pages, from the first on, were taken over from an interrupted writer, those without a tile
    /// included. They need not be appended again.
    pub fn taken_over(&self) -> u64 {
        self.taken_over
    }

    /// Appends a tile; each page once. A tile that was taken over is ignored.
    pub fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        let page = match self.writer.page(pos) {
            Some((_, true)) if self.taken_over > 0 => return Ok(()),
            Some((page, _)) => page,
            // Refused by the writer.
            None => return self.writer.append(pos, tile),
        };
        let head = TileHead::of(page, &tile);
        let destination = self.writer.destination(pos.level, head.hash, head.codec);
        // Cloning bytes counts a reference.
        let bytes = if destination == Destination::Memory { tile.tile().bytes.clone() } else { Bytes::new() };
        self.writer.append(pos, tile)?;
        self.journal.note(&head, &bytes);
        let unjournalled = self.writer.offset() - self.journalled;
        if unjournalled >= TILE_BYTES || self.journal.pending_bytes() >= JOURNAL_BYTES {
            self.bring_journal_up_to_date()?;
        }
        Ok(())
    }

    /// Notes that a page has no tile, so that a resumed build need not look at it again.
    pub fn skip(&mut self, pos: PagePos) -> Result<(), WriteError> {
        if let Some((page, false)) = self.writer.page(pos) {
            self.journal.note(&TileHead::absent(page), &[]);
        }
        if self.journal.pending_bytes() >= JOURNAL_BYTES {
            self.bring_journal_up_to_date()?;
        }
        Ok(())
    }

    /// Writes what was held back, the index and the header, puts the file in its place and removes the
    /// journal.
    pub fn finish(mut self) -> Result<Written, WriteError> {
        let failed = WriteError::io(&self.name);
        // So that what is written stays whole if the end cannot be written.
        self.bring_journal_up_to_date()?;
        let (out, written) = self.writer.complete()?;
        out.put_in_place(self.durable).map_err(failed)?;
        self.journal.set_keep(false);
        Ok(written)
    }

    /// Writes first the tiles, then their records: what the journal says is in the file, if only the process
    /// dies.
    fn bring_journal_up_to_date(&mut self) -> Result<(), WriteError> {
        use std::io::Write;
        self.writer.out_mut().flush().map_err(WriteError::io(&self.name))?;
        self.journal.write_pending().map_err(|error| WriteError::Io { name: self.journal.name(), error })?;
        self.journalled = self.writer.offset();
        Ok(())
    }

    /// Appends the tiles that the journal and the partial file have; cuts both off after that.
    fn take_over(&mut self, go_on: &mut dyn FnMut(u64) -> ControlFlow<()>) -> Result<(), WriteError> {
        let (failed, of_journal) = (WriteError::io(&self.name), WriteError::io(&self.journal.name()));
        let begin = self.writer.offset();
        let mut partial = self.writer.out_mut().reader_at(begin).map_err(&failed)?;
        let mut records = self.journal.records().map_err(&of_journal)?;
        while self.take_over_next(&mut records, &mut partial).map_err(&failed)? {
            self.taken_over += 1;
            if self.taken_over.is_multiple_of(64) && go_on(self.writer.offset()).is_break() {
                return Err(WriteError::Cancelled { name: self.name.clone() });
            }
        }
        self.journalled = self.writer.offset();
        self.writer.out_mut().go_on_at(self.journalled).map_err(&failed)?;
        self.journal.go_on_at(records.end()).map_err(&of_journal)
    }

    /// Appends the tile of the next record, if that and the tile's bytes are sound.
    fn take_over_next(&mut self, records: &mut Records, partial: &mut impl Read) -> std::io::Result<bool> {
        let raw_len = self.writer.description().tile_bytes();
        let Some(head) = records.next(raw_len)? else { return Ok(false) };
        let Some(pos) = self.writer.pos(head.page) else { return Ok(false) };
        if head.is_absent() {
            records.accept(0);
            return Ok(true);
        }
        let destination = self.writer.destination(pos.level, head.hash, head.codec);
        let bytes = match destination {
            Destination::Known => Some(Bytes::new()),
            Destination::Memory => head.read_sound_bytes(records.bytes())?,
            Destination::File if !skip_gap(partial, self.writer.gap().len())? => None,
            Destination::File => head.read_sound_bytes(partial)?,
        };
        let Some(bytes) = bytes else { return Ok(false) };
        let behind_record = if destination == Destination::Memory { head.len } else { 0 };
        // Refused where the page has a tile, which no writer notes twice.
        let appended = self.writer.take_over(pos, head.with_bytes(bytes, raw_len)).is_ok();
        if appended {
            records.accept(behind_record);
        }
        Ok(appended)
    }
}

/// Reads past the zeros before a tile. Returns true if all of them are there.
fn skip_gap(partial: &mut impl Read, len: usize) -> std::io::Result<bool> {
    let mut gap = Vec::with_capacity(len);
    partial.take(len as u64).read_to_end(&mut gap)?;
    Ok(gap.len() == len && gap.iter().all(|&byte| byte == 0))
}

/// Opens the journal beside the partial file, or returns `None` if there is none.
fn open_journal(name: &str, out: &TempFile, head: &Head) -> Result<Option<Journal>, WriteError> {
    let path = out.journal_path();
    let shown = path.display().to_string();
    let Some((journal, found)) = Journal::open(path).map_err(WriteError::io(&shown))? else {
        return Ok(None);
    };
    let of = match (found.others == head.others, found.input == head.input) {
        (true, true) => return Ok(Some(journal)),
        (true, false) => "another input, or the input has changed".to_owned(),
        (false, _) => match other_options(&found.options, &head.options) {
            named if named.is_empty() => "other options, or of another version of this program".to_owned(),
            named => format!("other options: {named}"),
        },
    };
    Err(WriteError::OtherBuild { name: name.into(), of })
}

/// The options of the build that is asked for whose values were others before, with both values.
fn other_options(before: &str, now: &str) -> String {
    let named = |line: &str| line.split_once(' ').map(|(name, value)| (name.to_owned(), value.to_owned()));
    let before: HashMap<String, String> = before.lines().filter_map(named).collect();
    let changed = now.lines().filter_map(named).filter_map(|(name, now)| {
        let before = before.get(&name).filter(|before| **before != now)?;
        Some(format!("{name} was {before} and is {now}"))
    });
    changed.collect::<Vec<_>>().join(", ")
}

/// What decides the bytes of a build. [`WriterOptions::durable`] changes no byte; all else does.
fn head_of(description: &Description, options: &WriterOptions, origin: Origin<'_>) -> Head {
    let deciding = WriterOptions { durable: false, ..options.clone() };
    let WriterOptions { filters, align, volume, about, .. } = options;
    let description = description::encode(description, filters, *align, volume.as_ref(), about);
    let all = format!("{} {deciding:?} {description:?} {}", env!("CARGO_PKG_VERSION"), origin.options);
    Head {
        input: checksum(origin.input),
        others: checksum(all.as_bytes()),
        options: origin.options.to_owned(),
    }
}
