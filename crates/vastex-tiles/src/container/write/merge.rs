//! Joining the parts of a container into the file that one build would have written.
//!
//! Which parts there are and how one is written stands in `part`. Nothing here is decoded: joining copies
//! bytes.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use vastex_core::{Description, PageNumbering};

use super::error::WriteError;
use super::part::{FixedHead, HEAD_BYTES, Head, PartOf};
use super::tile_head::TileHead;
use super::writer::{ContainerWriter, WriterOptions, Written};
use crate::container::format::description::{self, Contents};
use crate::container::format::layout::PART_MAGIC;
use crate::ground::advice::read_advice;
use crate::ground::hash::checksum;
use crate::ground::place::same_file;
use crate::tile::{Compression, EncodedTile};

/// Why parts cannot be joined. Nothing is left at the output's place.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A part cannot be read.
    #[error("{path}: cannot be read: {}", read_advice(.error), path = path.display())]
    Io {
        /// The part.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The part is a directory, a device or a pipe, which may never end.
    #[error("{}: is a directory, a device or a pipe; name the file that `vastex build --shard` made", .0.display())]
    NotAFile(PathBuf),
    /// The file is no part, or not as it was written.
    #[error("{path}: {fault}; make the part again with `vastex build --shard`", path = path.display())]
    Damaged {
        /// The part.
        path: PathBuf,
        /// What is wrong with the part.
        fault: String,
    },
    /// There are no parts, some are missing, or one is named twice.
    #[error("{0}")]
    Set(String),
    /// Two parts do not belong together.
    #[error(
        "{one} and {other} do not belong together: they differ in {what}; make all parts of one image with the same options",
        one = one.display(), other = other.display()
    )]
    Mismatch {
        /// One of the two parts.
        one: PathBuf,
        /// The part that does not fit it.
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
    /// The function that is told of progress asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Joins all parts of a container, in any order, into the file at `output`: the same bytes that one build
/// writes.
///
/// `progress` gets the number of tiles that are joined, and of all tiles; `Break` cancels. Takes the memory
/// of a [`ContainerWriter`].
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
    if let Some(part) = readers.iter().find(|reader| same_file(&reader.path, output)) {
        return Err(MergeError::SameFile(part.path.clone()));
    }
    let Contents { description, filters, align, volume, about } = readers[0].contents()?;
    if volume.is_some() {
        return Err(readers[0].damaged("it is of a volume, which is not made in parts".into()));
    }
    let options = WriterOptions { compression: Compression::None, durable, filters, align, volume, about };
    let mut writer = ContainerWriter::create(output, description.clone(), options)?;
    let numbering = PageNumbering::new(&description.geometry);
    let (mut done, total) = (0, numbering.pages());
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
            let pos = numbering.pos_of(page);
            let pos = pos.ok_or_else(|| reader.damaged(format!("page {page} of {total}")))?;
            if let Some(tile) = tile {
                writer.append(pos, tile)?;
            }
            done += 1;
        }
        reader.expect_end()?;
    }
    Ok(writer.finish()?)
}

/// Fails unless `readers`, which are sorted by number, are all parts of one container, each once.
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
        // Looked at before it is opened: opening a pipe would wait for a writer.
        if !std::fs::metadata(path).map_err(failed)?.is_file() {
            return Err(MergeError::NotAFile(path.into()));
        }
        let file = File::open(path).map_err(failed)?;
        let file = BufReader::with_capacity(1 << 20, file);
        let mut reader = PartReader { path: path.into(), file, head: Head::default() };
        let bytes = reader.bytes(HEAD_BYTES)?;
        if !bytes.starts_with(&PART_MAGIC) {
            return Err(reader.damaged("this is no part of a container".into()));
        }
        let fixed = FixedHead::decode(&bytes).map_err(|fault| reader.damaged(fault))?;
        let description = reader.bytes(fixed.description_len)?;
        reader.head = fixed.with_description(description).map_err(|fault| reader.damaged(fault))?;
        Ok(reader)
    }

    fn contents(&self) -> Result<Contents, MergeError> {
        description::decode(&self.head.description).map_err(|fault| self.damaged(fault.to_string()))
    }

    /// The number of the next page, and its tile if it has one.
    fn tile(&mut self, description: &Description) -> Result<(u64, Option<EncodedTile>), MergeError> {
        let raw_len = description.tile_bytes();
        let mut head = [0; TileHead::BYTES];
        self.fill(&mut head)?;
        let head = TileHead::decode(&head, raw_len).map_err(|fault| self.damaged(fault))?;
        if head.is_absent() {
            return Ok((head.page, None));
        }
        let bytes = self.bytes(head.len as usize)?;
        if checksum(&bytes) != head.checksum {
            return Err(self.damaged(format!("the tile of page {} is damaged", head.page)));
        }
        Ok((head.page, Some(head.with_bytes(Bytes::from(bytes), raw_len))))
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
        self.fill(&mut bytes).map(|()| bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), MergeError> {
        self.file.read_exact(bytes).map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => self.damaged("it ends too early".into()),
            _ => MergeError::Io { path: self.path.clone(), error },
        })
    }

    fn damaged(&self, fault: String) -> MergeError {
        MergeError::Damaged { path: self.path.clone(), fault }
    }
}
