//! Changing a container in place: new tiles and a new index are appended, then one header copy is
//! overwritten.
//!
//! Until that last write the other copy describes the version before, and no byte of that version is ever
//! overwritten: a program that reads it goes on reading it, and a change that is cut off leaves it whole.
//! What a page's new texels are is the builder's business.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use pollster::block_on;
use rustc_hash::FxHashMap;
use vastex_core::PagePos;

use super::error::WriteError;
use super::writer::{gap_before, held_level};
use crate::container::format::error::ContainerError;
use crate::container::format::header::{self, Header};
use crate::container::format::index::{self, Record};
use crate::container::format::layout::{Extent, HEADER_BYTES, HEADER_COPY_BYTES, NO_RECORD, Section};
use crate::container::read::Container;
use crate::sources::TileSource;
use crate::stores::FileStore;
use crate::tile::{Codec, EncodedTile, Tile};

/// Why a container was not changed. It is as it was before.
#[derive(Debug, thiserror::Error)]
pub enum UpdateError {
    /// The container cannot be opened, or is damaged where the change needs it.
    #[error(transparent)]
    Open(#[from] ContainerError),
    /// The container cannot be written, or a tile does not belong there.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Another program is changing or verifying the container.
    #[error("{name}: another program is changing or verifying it now; wait until that is done")]
    Busy {
        /// The file.
        name: String,
    },
}

/// What a change did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Updated {
    /// Pages that have a new tile.
    pub tiles: u64,
    /// Bytes by which the file grew.
    pub bytes_added: u64,
    /// Bytes of the file that belong to earlier versions only; building the file again gives them back.
    pub bytes_superseded: u64,
    /// Bytes of the file.
    pub bytes: u64,
}

/// A file that is changed: written at its end, and once at its header.
pub(in crate::container) trait Medium: Write + Seek + Send {
    /// Makes the file end at `len`.
    fn truncate(&mut self, len: u64) -> io::Result<()>;
    /// Waits until the disk has everything.
    fn sync(&mut self) -> io::Result<()>;
}

impl Medium for File {
    fn truncate(&mut self, len: u64) -> io::Result<()> {
        self.set_len(len)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.sync_all()
    }
}

/// What a change waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waits {
    /// Nothing: a loss of power may cost the file.
    Never,
    /// The disk has all that is appended, before the header is overwritten.
    BeforeTheHeader,
    /// In addition the disk has the header.
    Durable,
}

/// One change of a container, from its present version to the next. If it is dropped without
/// [`ContainerUpdate::commit`], the file stays as it was.
///
/// Takes 4 bytes a page and 48 a distinct tile of the file, and holds the coarse tiles, about 1 MiB, back
/// until the end.
pub struct ContainerUpdate {
    out: Box<dyn Medium>,
    old: Arc<Container>,
    waits: Waits,
    /// The highest sequence number of a header copy when the change began.
    newest: u64,
    /// The records of the version before, then the new ones.
    records: Vec<Record>,
    old_records: usize,
    record_of_content: FxHashMap<u128, u32>,
    pages: Vec<u32>,
    /// Texels of the new constant tiles.
    constants: Vec<u8>,
    held_level: u8,
    /// Bytes of new coarse tiles, by record.
    held: FxHashMap<u32, Bytes>,
    /// Where the next bytes go. As long as it is the old length, nothing has been written.
    offset: u64,
    /// Set when the header is about to be overwritten: from then on the file must not be cut.
    flipping: bool,
    tiles: u64,
}

impl ContainerUpdate {
    /// Opens a local file for one change, and keeps other programs from changing it meanwhile if the system
    /// can.
    ///
    /// The end of the change waits until the disk has what was appended before it overwrites the header, so
    /// that a loss of power leaves a whole version; `durable` waits for the header too, so that the whole
    /// version is the new one.
    pub fn open(path: impl AsRef<Path>, durable: bool) -> Result<ContainerUpdate, UpdateError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        // Opened for reading first: that names what is no container, and never waits for a pipe.
        let store = FileStore::open(path).map_err(ContainerError::from)?;
        block_on(Container::open(Arc::new(store)))?;
        let mut options = OpenOptions::new();
        options.read(true).write(true);
        keep_other_writers_out(&mut options);
        let file = options.open(path).map_err(|error| match is_kept_out(&error) {
            true => UpdateError::Busy { name: name.clone() },
            false => WriteError::Io { name: name.clone(), error }.into(),
        })?;
        // On other systems a lock keeps readers out as well. A file system without locks has none to ask for.
        if cfg!(unix) && matches!(file.try_lock(), Err(std::fs::TryLockError::WouldBlock)) {
            return Err(UpdateError::Busy { name });
        }
        // Only now is the version known that nobody else changes.
        let store = FileStore::open(path).map_err(ContainerError::from)?;
        let old = Arc::new(block_on(Container::open(Arc::new(store)))?);
        old.refuse_volume("is of a volume, of which no regions are replaced; build it again")?;
        ContainerUpdate::new(Box::new(file), old, durable)
    }

    /// A change of `old`, whose bytes are those of `out`.
    pub(in crate::container) fn new(
        out: Box<dyn Medium>,
        old: Arc<Container>,
        durable: bool,
    ) -> Result<ContainerUpdate, UpdateError> {
        let in_index = |fault: String| ContainerError::damaged(old.name(), "the index", &fault);
        let records = (0..old.index().records()).map(|number| old.index().record(number));
        let records = records.collect::<Result<Vec<_>, _>>().map_err(in_index)?;
        let pages: Vec<u32> = old.index().page_records().map(|number| number.unwrap_or(NO_RECORD)).collect();
        if pages.iter().any(|&number| number != NO_RECORD && number as usize >= records.len()) {
            return Err(in_index("a page names a record that does not exist".into()).into());
        }
        let newest = newest_of(&old)?;
        Ok(ContainerUpdate {
            waits: if durable { Waits::Durable } else { Waits::BeforeTheHeader },
            newest,
            old_records: records.len(),
            records,
            record_of_content: FxHashMap::default(),
            pages,
            constants: Vec::new(),
            held_level: held_level(old.description(), 1),
            held: FxHashMap::default(),
            offset: old.header().file_len,
            flipping: false,
            tiles: 0,
            old,
            out,
        })
    }

    /// Makes the change wait for no disk: for a file that may be lost with power, such as an intermediate
    /// step on the way to another file.
    pub fn without_waiting(mut self) -> ContainerUpdate {
        self.waits = Waits::Never;
        self
    }

    /// Returns true if nobody else has changed the file since this change began, as is possible on a file
    /// system without locks.
    fn is_alone(&self) -> Result<bool, ContainerError> {
        Ok(newest_of(&self.old)? == self.newest)
    }

    fn check_alone(&self) -> Result<(), UpdateError> {
        match self.is_alone()? {
            true => Ok(()),
            false => Err(UpdateError::Busy { name: self.old.name().into() }),
        }
    }

    /// The container as it was before the change.
    pub fn container(&self) -> &Arc<Container> {
        &self.old
    }

    /// Gives a page a new tile; each page once, in any order. Costs a look-up and a write.
    pub fn replace(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), UpdateError> {
        let refuse = |fault: String| WriteError::Tile { name: self.old.name().into(), pos, fault };
        let page = self.old.number_of(pos).ok_or_else(|| refuse("there is no such page".into()))? as usize;
        let now = self.pages[page];
        if now != NO_RECORD && now as usize >= self.old_records {
            return Err(refuse("the page has a new tile already".into()).into());
        }
        let (len, expected) = (tile.raw_len(), self.old.description().tile_bytes());
        if len != expected {
            return Err(refuse(format!("a tile of {len} bytes where {expected} are expected")).into());
        }
        if self.records.len() >= NO_RECORD as usize {
            return Err(refuse("more records than a page can name; build the file again".into()).into());
        }
        let number = match self.record_of_content.get(&tile.content()) {
            Some(&number) => number,
            None => self.add_record(pos.level, tile)?,
        };
        self.pages[page] = number;
        self.tiles += 1;
        Ok(())
    }

    fn add_record(&mut self, level: u8, tile: EncodedTile) -> Result<u32, WriteError> {
        let number = self.records.len() as u32;
        let (content, checksum) = (tile.content(), tile.checksum());
        let Tile { codec, bytes } = tile.into_tile();
        let extent = |offset| Extent { offset, len: bytes.len() as u64 };
        let extent = if codec == Codec::Constant {
            self.constants.extend_from_slice(&bytes);
            extent((self.constants.len() - bytes.len()) as u64)
        } else if level >= self.held_level {
            self.held.insert(number, bytes.clone());
            extent(0)
        } else {
            extent(self.put_tile(&bytes)?)
        };
        self.records.push(Record { section: Section { extent, checksum }, codec });
        self.record_of_content.insert(content, number);
        Ok(number)
    }

    /// Appends the coarse tiles and the new index, and makes the new version the current one. If no page has
    /// a new tile, the version before stays, and what an interrupted change left after it is cut off.
    pub fn commit(mut self) -> Result<Updated, UpdateError> {
        let (old_len, coarse_offset) = (self.old.header().file_len, self.offset);
        let mut superseded = self.old.index().superseded().map_err(|fault| self.damaged_index(&fault))?;
        if self.tiles == 0 {
            // Dropping the update cuts the file to the version that it has.
            let bytes_superseded = superseded.iter().map(|section| section.extent.len).sum();
            return Ok(Updated { tiles: 0, bytes_added: 0, bytes_superseded, bytes: old_len });
        }
        superseded.push(self.old.header().index);
        self.put_coarse_tiles(&mut superseded)?;
        let (records, constants) = self.drop_unused(&mut superseded)?;
        let index_bytes = index::encode(&records, &superseded, &self.pages, &constants);
        let index = Section::of(self.offset, &index_bytes);
        self.put(&index_bytes)?;
        self.check_alone()?;
        let (slot, newest) = self.free_copy()?;
        let description = self.old.header().description;
        let file_len = self.offset;
        self.flip(slot, &Header { sequence: newest + 1, file_len, description, index, coarse_offset })?;
        Ok(Updated {
            tiles: self.tiles,
            bytes_added: file_len - old_len,
            bytes_superseded: superseded.iter().map(|section| section.extent.len).sum(),
            bytes: file_len,
        })
    }

    /// Writes the tiles of the coarse levels next to each other before the index, unchanged ones included, so
    /// that opening stays two reads.
    fn put_coarse_tiles(&mut self, superseded: &mut Vec<Section>) -> Result<(), UpdateError> {
        let geometry = &self.old.description().geometry;
        let coarse_levels = self.held_level..geometry.tail().first_level();
        let coarse_pages = 1 + coarse_levels.map(|level| geometry.level(level).page_count()).sum::<u64>();
        for page in 0..coarse_pages as usize {
            let number = self.pages[page];
            let Some(record) = self.records.get(number as usize).copied() else { continue };
            let placed = record.section.extent.offset >= self.old.header().file_len;
            let bytes = match self.held.remove(&number) {
                Some(bytes) => bytes,
                None if record.codec == Codec::Constant || placed => continue,
                None => {
                    superseded.push(record.section);
                    self.old_bytes(&record)?
                }
            };
            self.records[number as usize].section.extent.offset = self.put_tile(&bytes)?;
        }
        Ok(())
    }

    fn old_bytes(&self, record: &Record) -> Result<Bytes, UpdateError> {
        let damaged = |fault: String| {
            ContainerError::damaged(self.old.name(), &record.section.extent.to_string(), &fault)
        };
        self.old.check_record(record).map_err(damaged)?;
        let bytes = block_on(self.old.bytes_of(record)).map_err(ContainerError::from)?;
        record.section.check(&bytes).map_err(damaged)?;
        Ok(bytes)
    }

    /// Renumbers the records that a page still names, and gathers the texels of constant ones. All other
    /// records are superseded.
    fn drop_unused(&mut self, superseded: &mut Vec<Section>) -> Result<(Vec<Record>, Vec<u8>), UpdateError> {
        let mut new_number = vec![NO_RECORD; self.records.len()];
        for &number in self.pages.iter().filter(|&&number| number != NO_RECORD) {
            new_number[number as usize] = 0;
        }
        let (mut kept, mut constants) = (Vec::new(), Vec::new());
        for (number, record) in self.records.iter().enumerate() {
            let is_constant = record.codec == Codec::Constant;
            if new_number[number] == NO_RECORD {
                if !is_constant {
                    superseded.push(record.section);
                }
                continue;
            }
            let mut record = *record;
            if is_constant {
                let texel = self.constant(number, record.section.extent)?;
                record.section.extent.offset = constants.len() as u64;
                constants.extend_from_slice(&texel);
            }
            new_number[number] = kept.len() as u32;
            kept.push(record);
        }
        for number in self.pages.iter_mut().filter(|number| **number != NO_RECORD) {
            *number = new_number[*number as usize];
        }
        Ok((kept, constants))
    }

    fn constant(&self, number: usize, extent: Extent) -> Result<Bytes, UpdateError> {
        if number < self.old_records {
            return self.old.index().constant(extent).map_err(|fault| self.damaged_index(&fault));
        }
        let first = extent.offset as usize;
        Ok(Bytes::copy_from_slice(&self.constants[first..first + extent.len as usize]))
    }

    /// The offset of the header copy that is not needed, and the highest sequence number.
    fn free_copy(&self) -> Result<(u64, u64), UpdateError> {
        let (copies, newest) = (header_copies(&self.old)?, self.newest);
        let a_is_needed = copies[0].as_ref() == Ok(self.old.header());
        if newest == u64::MAX {
            return Err(self.damaged_index("no further version can be numbered"));
        }
        Ok((if a_is_needed { HEADER_COPY_BYTES } else { 0 }, newest))
    }

    /// The one write that makes the new version the file's.
    fn flip(&mut self, slot: u64, header: &Header) -> Result<(), WriteError> {
        let name = self.old.name().to_string();
        let failed = |error| WriteError::Io { name: name.clone(), error };
        self.out.flush().map_err(failed)?;
        if self.waits != Waits::Never {
            self.out.sync().map_err(failed)?;
        }
        self.flipping = true;
        self.out
            .seek(SeekFrom::Start(slot))
            .and_then(|_| self.out.write_all(&header.encode()))
            .and_then(|()| self.out.flush())
            .map_err(failed)?;
        if self.waits == Waits::Durable {
            self.out.sync().map_err(failed)?;
        }
        Ok(())
    }

    /// Appends a tile with the file's alignment; returns where it lies.
    fn put_tile(&mut self, bytes: &[u8]) -> Result<u64, WriteError> {
        self.put(gap_before(self.offset, self.old.align()))?;
        self.put(bytes)
    }

    /// Appends bytes; returns where they lie.
    fn put(&mut self, bytes: &[u8]) -> Result<u64, WriteError> {
        let (offset, old_len) = (self.offset, self.old.header().file_len);
        if offset == old_len && !self.is_alone().unwrap_or(false) {
            return Err(WriteError::InUse { name: self.old.name().into() });
        }
        let mut write = || {
            if offset == old_len {
                // What an interrupted change left behind.
                self.out.truncate(old_len)?;
            }
            self.out.seek(SeekFrom::Start(offset))?;
            self.out.write_all(bytes)
        };
        write().map_err(|error| WriteError::Io { name: self.old.name().into(), error })?;
        self.offset += bytes.len() as u64;
        Ok(offset)
    }

    fn damaged_index(&self, fault: &str) -> UpdateError {
        ContainerError::damaged(self.old.name(), "the index", fault).into()
    }
}

/// Both header copies as they are now.
fn header_copies(container: &Container) -> Result<[Result<Header, header::CopyFault>; 2], ContainerError> {
    let bytes = block_on(container.store().read(0, HEADER_BYTES as usize))?;
    Ok(header::copies(&bytes).map(Header::decode))
}

/// The highest number of a version that a header copy has now.
fn newest_of(container: &Container) -> Result<u64, ContainerError> {
    let copies = header_copies(container)?;
    Ok(copies.iter().flatten().map(|header| header.sequence).max().unwrap_or(0))
}

/// Where locks would keep readers out, keeps others from opening the file for writing instead.
#[cfg(windows)]
fn keep_other_writers_out(options: &mut OpenOptions) {
    use std::os::windows::fs::OpenOptionsExt;
    const FILE_SHARE_READ: u32 = 1;
    const FILE_SHARE_DELETE: u32 = 4;
    options.share_mode(FILE_SHARE_READ | FILE_SHARE_DELETE);
}

#[cfg(not(windows))]
fn keep_other_writers_out(_: &mut OpenOptions) {}

/// Returns true if the error says that another program has the file open for writing.
fn is_kept_out(error: &io::Error) -> bool {
    const ERROR_SHARING_VIOLATION: i32 = 32;
    cfg!(windows) && error.raw_os_error() == Some(ERROR_SHARING_VIOLATION)
}

impl Drop for ContainerUpdate {
    fn drop(&mut self) {
        if self.flipping {
            return;
        }
        // What another program has made the file's is not cut, nor anything where that cannot be told.
        if !self.is_alone().unwrap_or(false) {
            return;
        }
        if let Err(error) = self.out.truncate(self.old.header().file_len) {
            tracing::warn!(name = self.old.name(), %error, "what was appended could not be cut off");
        }
    }
}

impl std::fmt::Debug for ContainerUpdate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ContainerUpdate")
            .field("old", &self.old)
            .field("tiles", &self.tiles)
            .finish_non_exhaustive()
    }
}
