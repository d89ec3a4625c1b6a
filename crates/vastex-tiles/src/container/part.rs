//! Parts of a container, made on different machines and joined into the file that one machine would have written.
//!
//! A container depends on its tiles and on the order in which they are appended, and on nothing else. A part holds
//! a run of that order: encoded tiles with their content hashes, so that joining parts is copying bytes. Which run,
//! and what order, is the builder's business. `docs/format.md` describes the file.

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use vastex_core::{Description, PagePos};

use super::description::{self, Contents};
use super::index::PageOrder;
use super::layout::{Fields, MAX_DESCRIPTION_BYTES, NO_RECORD};
use super::output::TempFile;
use super::writer::{ContainerWriter, WriteError, WriterOptions, Written};
use crate::encode::{Compression, EncodedTile};
use crate::hash::checksum;
use crate::tile::{Codec, Tile};

/// The first bytes of a part.
pub(super) const PART_MAGIC: [u8; 8] = *b"\x89VTXPART";
const VERSION: u32 = 1;
/// Bytes before the description.
const HEAD_BYTES: usize = 64;
/// Bytes before those of each tile.
const TILE_HEAD_BYTES: usize = 56;

/// Which part of a container a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartOf {
    /// Counted from 1.
    pub part: u32,
    /// How many there are.
    pub parts: u32,
}

impl PartOf {
    /// Part `part` of `parts`; nothing unless `part` is 1 to `parts`.
    pub fn new(part: u32, parts: u32) -> Option<PartOf> {
        (1..=parts).contains(&part).then_some(PartOf { part, parts })
    }

    /// The run of `tiles` tiles in the order of writing that this part holds: the first, and one past the last.
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
#[derive(Clone, Debug)]
struct Head {
    of: PartOf,
    /// The same in all parts that belong together.
    fingerprint: u64,
    tiles: u64,
    description: Vec<u8>,
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

/// Writes one part. Nothing is at the file's place until it is finished, nothing is left behind if it is not.
#[derive(Debug)]
pub struct PartWriter {
    out: TempFile,
    name: String,
    description: Description,
    order: PageOrder,
    durable: bool,
    missing: u64,
    written: Written,
}

impl PartWriter {
    /// Begins a part that [`PartWriter::finish`] will put at `path`. `fingerprint` stands for everything that
    /// the tiles of all parts depend on besides the description: parts with different ones are never joined.
    pub fn create(
        path: impl AsRef<Path>,
        description: Description,
        options: &WriterOptions,
        of: PartOf,
        fingerprint: &[u8],
    ) -> Result<PartWriter, WriteError> {
        let (path, name) = (path.as_ref(), path.as_ref().display().to_string());
        let checked = description::check(&description);
        if let Err(fault) = checked.and_then(|()| description::check_filters(&description, &options.filters))
        {
            return Err(WriteError::Description { name, fault });
        }
        let failed = |error| WriteError::Io { name: name.clone(), error };
        let mut out = TempFile::create(path).map_err(failed)?;
        let order = PageOrder::new(&description.geometry);
        let run = of.run(order.pages());
        let missing = run.end - run.start;
        let description_bytes = description::encode(&description, &options.filters);
        let fingerprint = checksum(fingerprint);
        let head = Head { of, fingerprint, tiles: missing, description: description_bytes }.encode();
        out.write_all(&head).map_err(failed)?;
        let written = Written { bytes: head.len() as u64, ..Written::default() };
        Ok(PartWriter { out, name, description, order, durable: options.durable, missing, written })
    }

    /// The texture being written.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Appends a tile: those of the part's run, in the order of writing.
    pub fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        let refuse = |fault: &str| WriteError::Tile { name: self.name.clone(), pos, fault: fault.into() };
        let page = self.order.number_of(&self.description.geometry, pos);
        let page = page.ok_or_else(|| refuse("there is no such page"))?;
        if tile.raw_len != self.description.tile_bytes() {
            return Err(refuse("a tile of the wrong length"));
        }
        self.missing =
            self.missing.checked_sub(1).ok_or_else(|| refuse("the part has all its tiles already"))?;
        let Tile { codec, bytes } = tile.tile;
        let mut head = Vec::from(page.to_le_bytes());
        head.extend(tile.hash.to_le_bytes());
        head.extend(tile.checksum.to_le_bytes());
        head.extend((bytes.len() as u64).to_le_bytes());
        head.extend(u64::from(codec.number()).to_le_bytes());
        head.extend(checksum(&head).to_le_bytes());
        let wrote = self.out.write_all(&head).and_then(|()| self.out.write_all(&bytes));
        wrote.map_err(|error| WriteError::Io { name: self.name.clone(), error })?;
        self.written.tiles += 1;
        self.written.constant_tiles += u64::from(codec == Codec::Constant);
        self.written.bytes += (head.len() + bytes.len()) as u64;
        Ok(())
    }

    /// Puts the part in its place.
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

/// Why parts cannot be joined. Nothing is left behind.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A part cannot be read.
    #[error("{path}: cannot be read: {error}; check the path and your rights to it", path = path.display())]
    Io {
        /// The part.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The file is no part, or not as it was written.
    #[error("{path}: {fault}; make the part again with `vastex build --shard`", path = path.display())]
    Damaged {
        /// The part.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// No parts, or not all, or one twice.
    #[error("{0}")]
    Set(String),
    /// Two parts do not belong together.
    #[error(
        "{one} and {other} do not belong together: they differ in {what}; make all parts of one image with the same options",
        one = one.display(), other = other.display()
    )]
    Mismatch {
        /// One of them.
        one: PathBuf,
        /// The other one.
        other: PathBuf,
        /// In what they differ.
        what: &'static str,
    },
    /// The output would overwrite a part.
    #[error("{}: is a part as well as the output; choose another name for the output", .0.display())]
    SameFile(PathBuf),
    /// The container cannot be written.
    #[error(transparent)]
    Output(#[from] WriteError),
    /// `progress` asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Joins all parts of a container, in any order, into the file at `output`: the very bytes that one build writes.
///
/// `progress` is told how many tiles of how many are joined; `Break` cancels. Memory is what the writer needs.
pub fn merge(
    parts: &[impl AsRef<Path>],
    output: &Path,
    durable: bool,
    mut progress: impl FnMut(u64, u64) -> std::ops::ControlFlow<()>,
) -> Result<Written, MergeError> {
    let mut readers =
        parts.iter().map(|path| PartReader::open(path.as_ref())).collect::<Result<Vec<_>, _>>()?;
    readers.sort_by_key(|reader| reader.head.of.part);
    check_set(&readers)?;
    let is_output =
        |path: &Path| matches!((path.canonicalize(), output.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if let Some(part) = readers.iter().find(|reader| is_output(&reader.path)) {
        return Err(MergeError::SameFile(part.path.clone()));
    }
    let Contents { description, filters } = readers[0].contents()?;
    let options = WriterOptions { compression: Compression::None, durable, filters };
    let mut writer = ContainerWriter::create(output, description.clone(), options)?;
    let order = PageOrder::new(&description.geometry);
    let (mut done, total) = (0, order.pages());
    for reader in &mut readers {
        let expected = reader.head.of.run(total);
        if reader.head.tiles != expected.end - expected.start {
            return Err(reader.damaged(format!(
                "it has {} tiles of {}",
                reader.head.tiles,
                expected.end - expected.start
            )));
        }
        for _ in expected {
            if done % 64 == 0 && progress(done, total).is_break() {
                return Err(MergeError::Cancelled);
            }
            let (page, tile) = reader.tile(&description)?;
            let pos = order.pos_of(&description.geometry, page);
            let pos = pos.ok_or_else(|| reader.damaged(format!("page {page} of {total}")))?;
            writer.append(pos, tile)?;
            done += 1;
        }
        reader.expect_end()?;
    }
    Ok(writer.finish()?)
}

/// All parts of one container, each once; `readers` are sorted by their numbers.
fn check_set(readers: &[PartReader]) -> Result<(), MergeError> {
    let Some(first) = readers.first() else {
        return Err(MergeError::Set("no parts: name all parts of one container".into()));
    };
    for reader in readers {
        let mismatch = |what| {
            let (one, other) = (first.path.clone(), reader.path.clone());
            Err(MergeError::Mismatch { one, other, what })
        };
        if reader.head.of.parts != first.head.of.parts {
            return mismatch("the number of parts");
        }
        if reader.head.description != first.head.description {
            return mismatch("size, pages, layers or filters");
        }
        if reader.head.fingerprint != first.head.fingerprint {
            return mismatch("the image or the compression");
        }
    }
    if let Some([one, other]) = readers.array_windows().find(|[a, b]| a.head.of == b.head.of) {
        let (one, other, of) = (one.path.display(), other.path.display(), one.head.of);
        return Err(MergeError::Set(format!("{one} and {other} are both {of}; name each part once")));
    }
    let missing = (1..=first.head.of.parts).find(|&n| readers.iter().all(|reader| reader.head.of.part != n));
    match missing {
        Some(n) => {
            let missing = PartOf { part: n, parts: first.head.of.parts };
            Err(MergeError::Set(format!(
                "{missing} is missing; make it with `vastex build --shard {n}/{}`",
                missing.parts
            )))
        }
        None => Ok(()),
    }
}

/// Reads a part from its beginning to its end.
struct PartReader {
    path: PathBuf,
    file: BufReader<File>,
    head: Head,
}

impl PartReader {
    fn open(path: &Path) -> Result<PartReader, MergeError> {
        let failed = |error| MergeError::Io { path: path.into(), error };
        let file = File::open(path).map_err(failed)?;
        if !file.metadata().map_err(failed)?.is_file() {
            return Err(failed(std::io::Error::other("this is no file")));
        }
        let nobody = PartOf { part: 0, parts: 0 };
        let head = Head { of: nobody, fingerprint: 0, tiles: 0, description: Vec::new() };
        let mut reader =
            PartReader { path: path.into(), file: BufReader::with_capacity(1 << 20, file), head };
        let bytes = reader.bytes(HEAD_BYTES)?;
        reader.head = reader.decode_head(&bytes)?;
        Ok(reader)
    }

    fn decode_head(&mut self, bytes: &[u8]) -> Result<Head, MergeError> {
        if !bytes.starts_with(&PART_MAGIC) {
            return Err(self.damaged("this is no part of a container".into()));
        }
        let (checked, stated) = bytes.split_at(HEAD_BYTES - 8);
        let mut fields = Fields::new(&checked[PART_MAGIC.len()..]);
        let mut read = || -> Result<_, String> {
            Ok((
                [fields.u32()?, fields.u32()?, fields.u32()?, fields.u32()?],
                [fields.u64()?, fields.u64()?, fields.u64()?, fields.u64()?],
            ))
        };
        let ([version, part, parts, zero], [fingerprint, tiles, len, description_checksum]) =
            read().map_err(|fault| self.damaged(fault))?;
        if version != VERSION {
            return Err(self.damaged(format!("it is of version {version}, this program reads {VERSION}")));
        }
        if checksum(checked).to_le_bytes() != stated || zero != 0 || len > MAX_DESCRIPTION_BYTES {
            return Err(self.damaged("its beginning is damaged".into()));
        }
        let of = PartOf::new(part, parts).ok_or_else(|| self.damaged(format!("part {part} of {parts}")))?;
        let description = self.bytes(len as usize)?;
        if checksum(&description) != description_checksum {
            return Err(self.damaged("its description is damaged".into()));
        }
        Ok(Head { of, fingerprint, tiles, description })
    }

    fn contents(&self) -> Result<Contents, MergeError> {
        description::decode(&self.head.description).map_err(|fault| self.damaged(fault.to_string()))
    }

    /// The next tile and its page's number.
    fn tile(&mut self, description: &Description) -> Result<(u64, EncodedTile), MergeError> {
        let head = self.bytes(TILE_HEAD_BYTES)?;
        let (checked, stated) = head.split_at(TILE_HEAD_BYTES - 8);
        if checksum(checked).to_le_bytes() != stated {
            return Err(self.damaged("the beginning of a tile is damaged".into()));
        }
        let mut fields = Fields::new(checked);
        let mut read = || -> Result<_, String> {
            let (page, low, high) = (fields.u64()?, fields.u64()?, fields.u64()?);
            let (tile_checksum, len, codec) = (fields.u64()?, fields.u64()?, fields.u64()?);
            let codec = u8::try_from(codec).map_err(|e| e.to_string()).and_then(Codec::from_number)?;
            Ok((page, u128::from(high) << 64 | u128::from(low), tile_checksum, len, codec))
        };
        let (page, hash, tile_checksum, len, codec) = read().map_err(|fault| self.damaged(fault))?;
        let raw_len = description.tile_bytes();
        if len == 0 || len > raw_len as u64 || page >= u64::from(NO_RECORD) {
            return Err(self.damaged(format!("a tile of {len} bytes where {raw_len} are the most")));
        }
        let bytes = self.bytes(len as usize)?;
        if checksum(&bytes) != tile_checksum {
            return Err(self.damaged(format!("the tile of page {page} is damaged")));
        }
        let tile = Tile { codec, bytes: Bytes::from(bytes) };
        Ok((page, EncodedTile { tile, hash, checksum: tile_checksum, raw_len }))
    }

    fn expect_end(&mut self) -> Result<(), MergeError> {
        let mut byte = [0];
        match self.file.read(&mut byte) {
            Ok(0) => Ok(()),
            Ok(_) => Err(self.damaged("it goes on after its last tile".into())),
            Err(error) => Err(MergeError::Io { path: self.path.clone(), error }),
        }
    }

    /// The next `len` bytes; `len` is known to be sensible.
    fn bytes(&mut self, len: usize) -> Result<Vec<u8>, MergeError> {
        let mut bytes = vec![0; len];
        match self.file.read_exact(&mut bytes) {
            Ok(()) => Ok(bytes),
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                Err(self.damaged("it ends too early".into()))
            }
            Err(error) => Err(MergeError::Io { path: self.path.clone(), error }),
        }
    }

    fn damaged(&self, fault: String) -> MergeError {
        MergeError::Damaged { path: self.path.clone(), fault }
    }
}
