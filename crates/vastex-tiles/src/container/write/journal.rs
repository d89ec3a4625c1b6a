//! The journal of a build: which tiles the partial file beside it has, so that a killed build can be resumed.
//!
//! After a head with fingerprints of everything that decides the bytes, and with the options by name, stands
//! one small record for each appended tile, with the bytes of those tiles that are written to the partial
//! file at its end only. A journal promises nothing: whoever resumes checks every tile, so that writing a
//! journal needs no particular order and no waiting for the disk. A journal is of use on the machine and to
//! the version of the program that wrote it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use super::tile_head::TileHead;
use crate::container::format::layout::Fields;
use crate::ground::hash::checksum;

const MAGIC: [u8; 8] = *b"\x89VTXJRNL";
const VERSION: u64 = 3;
/// Bytes of magic, version, two fingerprints, and the checksum of these; the options follow.
const FIXED_BYTES: usize = 40;
/// Bytes that a head has at most; one with longer options is never found sound.
const MAX_HEAD_BYTES: usize = 1 << 16;

/// What decides the bytes of a build.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Head {
    /// Fingerprint of the input.
    pub(super) input: u64,
    /// Fingerprint of everything else, the options and this program's version included.
    pub(super) others: u64,
    /// [`Origin::options`](super::resume::Origin::options).
    pub(super) options: String,
}

impl Head {
    fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::from(MAGIC);
        bytes.extend([VERSION, self.input, self.others].map(u64::to_le_bytes).concat());
        bytes.extend(checksum(&bytes).to_le_bytes());
        bytes.extend((self.options.len() as u64).to_le_bytes());
        bytes.extend(self.options.as_bytes());
        bytes.extend(checksum(self.options.as_bytes()).to_le_bytes());
        bytes
    }

    /// Returns the head that a journal begins with, or `None` if it is torn or damaged. In one of another
    /// version, all but the input is other.
    fn decode(bytes: &[u8]) -> Option<Head> {
        let (fixed, rest) = bytes.split_at_checked(FIXED_BYTES)?;
        let (checked, stated) = fixed.split_at(FIXED_BYTES - 8);
        if !checked.starts_with(&MAGIC) || stated != checksum(checked).to_le_bytes() {
            return None;
        }
        let mut fields = Fields::new(&checked[MAGIC.len()..]);
        let (version, input, others) = (fields.u64().ok()?, fields.u64().ok()?, fields.u64().ok()?);
        if version != VERSION {
            return Some(Head { input, others: !others, options: String::new() });
        }
        let mut fields = Fields::new(rest);
        let len = usize::try_from(fields.u64().ok()?).ok()?;
        let options = fields.bytes(len).ok()?;
        let is_sound = fields.u64().ok()? == checksum(options);
        let options = std::str::from_utf8(options).ok().filter(|_| is_sound)?;
        Some(Head { input, others, options: options.to_owned() })
    }
}

/// A journal being written. Removed when dropped, unless it is to be kept.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    /// Where the first record begins.
    begin: u64,
    keep: bool,
    /// Records that are not yet in the file.
    pending: Vec<u8>,
}

impl Journal {
    /// Begins a journal without tiles, in place of what is at `path`.
    pub(super) fn create(path: PathBuf, head: &Head) -> io::Result<Journal> {
        let file = File::create(&path)?;
        let pending = head.encode();
        let mut journal = Journal { file, path, begin: pending.len() as u64, keep: false, pending };
        journal.write_pending()?;
        Ok(journal)
    }

    /// Opens the journal that an interrupted build left at `path`, which is kept when dropped, and reads its
    /// head. `None` if there is no journal, or none that got as far as its first tile.
    pub(super) fn open(path: PathBuf) -> io::Result<Option<(Journal, Head)>> {
        // A pipe would be waited for.
        if std::fs::metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(io::Error::other("this is in the way and no file; remove it"));
        }
        let mut file = match OpenOptions::new().read(true).write(true).open(&path) {
            Ok(file) => file,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e),
        };
        let mut head = Vec::new();
        (&mut file).take(MAX_HEAD_BYTES as u64).read_to_end(&mut head)?;
        let head = Head::decode(&head);
        Ok(head.map(|head| {
            let begin = head.encode().len() as u64;
            (Journal { file, path, begin, keep: true, pending: Vec::new() }, head)
        }))
    }

    /// Reads the records from the first one on; writing goes on after [`Journal::go_on_at`] only.
    pub(super) fn records(&mut self) -> io::Result<Records> {
        self.file.seek(SeekFrom::Start(self.begin))?;
        let file = BufReader::with_capacity(1 << 16, self.file.try_clone()?);
        Ok(Records { file, offset: self.begin })
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
        if self.keep
            && let Err(error) = self.write_pending()
        {
            // Records that cannot be written are tiles that are made once more. What ended the write, such as
            // a full disk, is told by the write's own error.
            tracing::info!(path = %self.path.display(), %error, "the rest of a journal could not be written");
        } else if !self.keep
            && let Err(error) = fs::remove_file(&self.path)
        {
            tracing::warn!(path = %self.path.display(), %error, "a journal could not be removed");
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
