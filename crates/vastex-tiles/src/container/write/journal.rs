//! The journal of a build: which tiles the partial file beside it has, so that a killed build can be resumed.
//!
//! After a head with fingerprints of everything that decides the bytes stands one small record for each
//! appended tile, with the bytes of those tiles that are written to the partial file at its end only. A
//! journal promises nothing: whoever resumes checks every tile, so that writing a journal needs no particular
//! order and no waiting for the disk. A journal is of use on the machine and to the version of the program
//! that wrote it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use super::tile_head::TileHead;
use crate::container::format::layout::Fields;
use crate::ground::hash::checksum;

const MAGIC: [u8; 8] = *b"\x89VTXJRNL";
const VERSION: u64 = 1;
/// Bytes of the head: magic, version, two fingerprints, and the checksum of these.
const HEAD_BYTES: usize = 40;

/// What decides the bytes of a build, as fingerprints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    /// Of the input.
    pub(super) input: u64,
    /// Of everything else, this program's version included.
    pub(super) options: u64,
}

impl Head {
    fn encode(self) -> Vec<u8> {
        let mut bytes = Vec::from(MAGIC);
        bytes.extend([VERSION, self.input, self.options].map(u64::to_le_bytes).concat());
        bytes.extend(checksum(&bytes).to_le_bytes());
        bytes
    }

    /// `None` if the head is torn or damaged. A version that is not known counts as other options.
    fn decode(bytes: &[u8]) -> Option<Head> {
        let (checked, stated) = bytes.split_at_checked(HEAD_BYTES - 8)?;
        if !checked.starts_with(&MAGIC) || stated != checksum(checked).to_le_bytes() {
            return None;
        }
        let mut fields = Fields::new(&checked[MAGIC.len()..]);
        let (version, input, options) = (fields.u64().ok()?, fields.u64().ok()?, fields.u64().ok()?);
        Some(Head { input, options: if version == VERSION { options } else { !options } })
    }
}

/// A journal being written. Removed when dropped, unless it is to be kept.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    keep: bool,
    /// Records that are not yet in the file.
    pending: Vec<u8>,
}

impl Journal {
    /// Begins a journal without tiles, in place of what is at `path`.
    pub(super) fn create(path: PathBuf, head: Head) -> io::Result<Journal> {
        let file = File::create(&path)?;
        let mut journal = Journal { file, path, keep: false, pending: head.encode() };
        journal.write_pending()?;
        Ok(journal)
    }

    /// Opens the journal that an interrupted build left at `path`, which is kept when dropped, and reads its
    /// head. `None` if there is no journal, or none that got as far as its first tile.
    pub(super) fn open(path: PathBuf) -> io::Result<Option<(Journal, Head)>> {
        let mut file = match OpenOptions::new().read(true).write(true).open(&path) {
            Ok(file) => file,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e),
        };
        let mut head = Vec::with_capacity(HEAD_BYTES);
        (&mut file).take(HEAD_BYTES as u64).read_to_end(&mut head)?;
        let head = Head::decode(&head);
        Ok(head.map(|head| (Journal { file, path, keep: true, pending: Vec::new() }, head)))
    }

    /// Reads the records from the first one on; writing goes on after [`Journal::go_on_at`] only.
    pub(super) fn records(&mut self) -> io::Result<Records> {
        self.file.seek(SeekFrom::Start(HEAD_BYTES as u64))?;
        let file = BufReader::with_capacity(1 << 16, self.file.try_clone()?);
        Ok(Records { file, offset: HEAD_BYTES as u64 })
    }

    /// Leaves `len` bytes and goes on behind them.
    pub(super) fn go_on_at(&mut self, len: u64) -> io::Result<()> {
        self.file.set_len(len)?;
        self.file.seek(SeekFrom::Start(len)).map(drop)
    }

    /// Notes a tile; `bytes` are those that the partial file does not have.
    pub(super) fn note(&mut self, tile: &TileHead, bytes: &[u8]) {
        self.pending.extend(tile.encode());
        self.pending.extend(bytes);
    }

    /// Bytes that wait to be written.
    pub(super) fn pending_bytes(&self) -> usize {
        self.pending.len()
    }

    /// Hands what waits to the system.
    pub(super) fn write_pending(&mut self) -> io::Result<()> {
        self.file.write_all(&self.pending)?;
        self.pending.clear();
        Ok(())
    }

    /// Sets that the file stays when the journal is dropped.
    pub(super) fn set_keep(&mut self, keep: bool) {
        self.keep = keep;
    }

    /// The file's name, for messages.
    pub(super) fn name(&self) -> String {
        self.path.display().to_string()
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        // Records that cannot be written are tiles that are made once more.
        let left = if self.keep { self.write_pending() } else { fs::remove_file(&self.path) };
        if let Err(error) = left {
            tracing::warn!(path = %self.path.display(), %error, "a journal could not be written or removed");
        }
    }
}

/// The records of a journal, from the first one on.
pub(super) struct Records {
    file: BufReader<File>,
    /// Where the next record begins.
    offset: u64,
}

impl Records {
    /// The next record, or `None` if there is no sound one. The bytes that may follow the record are read
    /// from [`Records::bytes`].
    pub(super) fn next(&mut self, raw_len: usize) -> io::Result<Option<TileHead>> {
        TileHead::read_sound(&mut self.file, raw_len)
    }

    /// What may follow a record.
    pub(super) fn bytes(&mut self) -> &mut impl Read {
        &mut self.file
    }

    /// Accepts the last record, which has so many bytes behind it.
    pub(super) fn accept(&mut self, bytes: u64) {
        self.offset += TileHead::BYTES as u64 + bytes;
    }

    /// Where the accepted records end.
    pub(super) fn end(&self) -> u64 {
        self.offset
    }
}
