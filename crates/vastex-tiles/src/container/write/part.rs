//! Parts of a container, made on different machines and joined into the file that one machine would have
//! written.
//!
//! A container depends on its tiles and on the order in which they are appended, and on nothing else. A part
//! holds a run of that order: encoded tiles with their content hashes, so that joining parts (`merge`) only
//! copies bytes. Which run, and what order, is the builder's business. A part is its own journal: each tile
//! has a head with its checksum, which is checked before an interrupted part is resumed. `docs/format.md`
//! describes the file.

use std::fs;
use std::io::{self, Read, Write};
use std::ops::ControlFlow;
use std::path::Path;

use vastex_core::{Description, PageNumbering, PagePos};

use super::error::WriteError;
use super::output::TempFile;
use super::resume::Left;
use super::tile_head::TileHead;
use super::writer::{WriterOptions, Written};
use crate::container::format::description;
use crate::container::format::layout::{Fields, MAX_DESCRIPTION_BYTES, PART_MAGIC};
use crate::ground::hash::checksum;
use crate::tile::Codec;
use crate::tile::EncodedTile;

const VERSION: u32 = 1;
/// Bytes before the description.
pub(super) const HEAD_BYTES: usize = 64;

/// Which part of a container a file is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartOf {
    /// The number of the part, counted from 1.
    pub part: u32,
    /// The number of parts.
    pub parts: u32,
}

impl PartOf {
    /// Part `part` of `parts`, or `None` unless `part` is 1 to `parts`.
    pub fn new(part: u32, parts: u32) -> Option<PartOf> {
        (1..=parts).contains(&part).then_some(PartOf { part, parts })
    }

    /// The tiles that this part holds, out of `tiles` in the order of writing.
    pub fn run(self, tiles: u64) -> std::ops::Range<u64> {
        let bound = |part: u32| (u128::from(tiles) * u128::from(part) / u128::from(self.parts)) as u64;
        bound(self.part - 1)..bound(self.part)
    }
}

impl std::fmt::Display for PartOf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "part {} of {}", self.part, self.parts)
    }
}

/// What stands at the beginning of a part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) of: PartOf,
    /// A number that is equal in all parts that belong together.
    pub(super) fingerprint: u64,
    pub(super) tiles: u64,
    pub(super) description: Vec<u8>,
}

impl Head {
    fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::from(PART_MAGIC);
        bytes.extend([VERSION, self.of.part, self.of.parts, 0].map(u32::to_le_bytes).concat());
        let len = self.description.len() as u64;
        bytes.extend(
            [self.fingerprint, self.tiles, len, checksum(&self.description)].map(u64::to_le_bytes).concat(),
        );
        bytes.extend(checksum(&bytes).to_le_bytes());
        bytes.extend(&self.description);
        bytes
    }
}

/// The first [`HEAD_BYTES`] of a part, after which the description follows.
pub(super) struct FixedHead {
    head: Head,
    pub(super) description_len: usize,
    description_checksum: u64,
}

impl FixedHead {
    /// Reads the fixed head, or returns what is wrong with it.
    pub(super) fn decode(bytes: &[u8]) -> Result<FixedHead, String> {
        let (checked, stated) = bytes.split_at_checked(HEAD_BYTES - 8).ok_or("it ends too early")?;
        let mut fields = Fields::new(checked);
        fields.bytes(PART_MAGIC.len())?;
        let [version, part, parts, zero] = [fields.u32()?, fields.u32()?, fields.u32()?, fields.u32()?];
        let (fingerprint, tiles) = (fields.u64()?, fields.u64()?);
        let (len, description_checksum) = (fields.u64()?, fields.u64()?);
        if version != VERSION {
            return Err(format!("it is of version {version}, this program reads {VERSION}"));
        }
        if checksum(checked).to_le_bytes() != stated || zero != 0 || len > MAX_DESCRIPTION_BYTES {
            return Err("its beginning is damaged".into());
        }
        let of = PartOf::new(part, parts).ok_or_else(|| format!("part {part} of {parts}"))?;
        let head = Head { of, fingerprint, tiles, description: Vec::new() };
        Ok(FixedHead { head, description_len: len as usize, description_checksum })
    }

    pub(super) fn with_description(self, description: Vec<u8>) -> Result<Head, String> {
        if checksum(&description) != self.description_checksum {
            return Err("its description is damaged".into());
        }
        Ok(Head { description, ..self.head })
    }
}

/// Writes one part of a container. The file appears at its place only when it is finished.
#[derive(Debug)]
pub struct PartWriter {
    out: TempFile,
    name: String,
    description: Description,
    numbering: PageNumbering,
    durable: bool,
    missing: u64,
    written: Written,
    taken_over: u64,
}

impl PartWriter {
    /// Begins a part that [`PartWriter::finish`] will put at `path`, or resumes one. `fingerprint` stands for
    /// everything that the tiles of all parts depend on besides the description: parts with different
    /// fingerprints are never joined, and a part with another fingerprint is not resumed.
    pub fn create(
        path: impl AsRef<Path>,
        description: Description,
        options: &WriterOptions,
        of: PartOf,
        fingerprint: &[u8],
        left: Left<'_>,
    ) -> Result<PartWriter, WriteError> {
        let (path, name) = (path.as_ref(), path.as_ref().display().to_string());
        if let Err(fault) = options.check(&description) {
            return Err(WriteError::Description { name, fault });
        }
        let claimed = TempFile::claim(path).map_err(WriteError::io(&name))?;
        let out = claimed.ok_or_else(|| WriteError::InUse { name: name.clone() })?;
        let numbering = PageNumbering::new(&description.geometry);
        let run = of.run(numbering.pages());
        let tiles = run.end - run.start;
        let WriterOptions { filters, align, about, .. } = options;
        let description_bytes = description::encode(&description, filters, *align, None, about);
        let head = Head { of, fingerprint: checksum(fingerprint), tiles, description: description_bytes };
        let (durable, written) = (options.durable, Written::default());
        let mut part =
            PartWriter { out, name, description, numbering, durable, missing: tiles, written, taken_over: 0 };
        part.begin(&head.encode(), left)?;
        Ok(part)
    }

    /// Resumes what an interrupted writer left, or starts anew.
    fn begin(&mut self, head: &[u8], left: Left<'_>) -> Result<(), WriteError> {
        let failed = WriteError::io(&self.name);
        self.written.bytes = head.len() as u64;
        if let Left::Resumed(go_on) = left {
            let mut partial = self.out.reader_at(0).map_err(&failed)?;
            let mut found = Vec::with_capacity(head.len());
            (&mut partial).take(head.len() as u64).read_to_end(&mut found).map_err(&failed)?;
            if found == head {
                return self.take_over(&mut partial, go_on);
            }
            // The beginning of a head is all that is left of a writer that was killed at once.
            if !head.starts_with(&found) {
                let of = "another image, part or options".to_owned();
                return Err(WriteError::OtherBuild { name: self.name.clone(), of });
            }
            self.out.set_keep(true);
        } else {
            self.out.set_keep(false);
        }
        // That of a whole container, which was to stand in the same place.
        let _ = fs::remove_file(self.out.journal_path());
        self.out.go_on_at(0).and_then(|()| self.out.write_all(head)).map_err(failed)
    }

    /// Counts the tiles that are whole and sound, and cuts the file off after them.
    fn take_over(
        &mut self,
        partial: &mut impl Read,
        go_on: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<(), WriteError> {
        let failed = WriteError::io(&self.name);
        while self.missing > 0
            && let Some(head) = sound_tile(partial, self.description.tile_bytes()).map_err(&failed)?
        {
            self.count(&head);
            self.taken_over += 1;
            if self.taken_over.is_multiple_of(64) && go_on(self.written.bytes).is_break() {
                return Err(WriteError::Cancelled { name: self.name.clone() });
            }
        }
        self.out.go_on_at(self.written.bytes).map_err(failed)
    }

    /// How many pages, from the first of the run on, were taken over from an interrupted writer, those
    /// without a tile included. They must not be appended again.
    pub fn taken_over(&self) -> u64 {
        self.taken_over
    }

    /// The texture being written.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Appends a tile. Tiles come in the order of writing, and pages without a tile are
    /// [skipped](PartWriter::skip).
    pub fn append(&mut self, pos: PagePos, tile: &EncodedTile) -> Result<(), WriteError> {
        let refuse = |fault: &str| WriteError::Tile { name: self.name.clone(), pos, fault: fault.into() };
        let page = self.numbering.number_of(pos);
        let page = page.ok_or_else(|| refuse("there is no such page"))?;
        if tile.raw_len() != self.description.tile_bytes() {
            return Err(refuse("a tile of the wrong length"));
        }
        if self.missing == 0 {
            return Err(refuse("the part has all its tiles already"));
        }
        let head = TileHead::of(page, tile);
        let wrote = self.out.write_all(&head.encode()).and_then(|()| self.out.write_all(&tile.tile().bytes));
        wrote.map_err(WriteError::io(&self.name))?;
        self.count(&head);
        Ok(())
    }

    /// Notes that the next page of the part's run has no tile.
    pub fn skip(&mut self, pos: PagePos) -> Result<(), WriteError> {
        let page = self.numbering.number_of(pos);
        let Some(page) = page.filter(|_| self.missing > 0) else {
            let fault = "it is no page of this part".into();
            return Err(WriteError::Tile { name: self.name.clone(), pos, fault });
        };
        let head = TileHead::absent(page);
        self.out.write_all(&head.encode()).map_err(WriteError::io(&self.name))?;
        self.count(&head);
        Ok(())
    }

    fn count(&mut self, tile: &TileHead) {
        self.missing -= 1;
        self.written.tiles += u64::from(!tile.is_absent());
        self.written.constant_tiles += u64::from(tile.codec == Codec::Constant);
        self.written.bytes += TileHead::BYTES as u64 + tile.len;
    }

    /// Puts the part in its place. Fails if tiles of the run are missing.
    pub fn finish(self) -> Result<Written, WriteError> {
        if self.missing > 0 {
            return Err(WriteError::Incomplete {
                name: self.name,
                missing: "tiles of this part are missing",
            });
        }
        let name = self.name;
        self.out.put_in_place(self.durable).map_err(|error| WriteError::Io { name, error })?;
        Ok(self.written)
    }
}

/// The next tile of a part, or `None` if there is no whole and sound one.
fn sound_tile(partial: &mut impl Read, raw_len: usize) -> io::Result<Option<TileHead>> {
    let Some(head) = TileHead::read_sound(partial, raw_len)? else { return Ok(None) };
    Ok(head.read_sound_bytes(partial)?.map(|_| head))
}
