//! Writing a container: tiles are appended as they come; coarse tiles, index and header follow at the end.
//!
//! Encoding and hashing ([`EncodedTile::new`]) is for as many threads as there are;
//! [`ContainerWriter::append`] is the serial part: it finds identical tiles and copies bytes. The file
//! depends on the tiles and the order in which they are appended, and on nothing else.

use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use bytes::Bytes;
use rustc_hash::FxHashMap;
use vastex_core::{Description, PageNumbering, PagePos};

use super::error::WriteError;
use super::output::TempFile;
use crate::container::format::description::{self, ContainerVolume};
use crate::container::format::header::Header;
use crate::container::format::index::{self, Record};
use crate::container::format::layout::{Extent, HEADER_BYTES, MAX_COARSE_BYTES, NO_RECORD, Section};
use crate::tile::{Codec, Compression, EncodedTile, Tile};

/// Decoded bytes of the coarse tiles that are held back, so that they lie together before the index. The tail
/// is always held back.
const HELD_BYTES: u64 = 1 << 20;

/// How a container is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WriterOptions {
    /// How [`ContainerWriter::write_tile`] compresses.
    pub compression: Compression,
    /// The name of the filter that makes the levels of each layer, for
    /// [`Container::filters`](crate::Container::filters); or empty.
    pub filters: Vec<String>,
    /// If true, finishing waits until the disk has everything.
    pub durable: bool,
    /// Every tile in the file begins at a multiple of so many bytes, for direct I/O: 1 (the default) for no
    /// alignment, or a power of two from 4096 to 65,536. Costs on average half of that for each distinct
    /// tile.
    pub align: u32,
    /// Which volume the container is of: then it has a texture for each of the volume's channels and times.
    pub volume: Option<ContainerVolume>,
    /// What else is known of the texels, for [`Container::about`](crate::Container::about): lines of words,
    /// which the container does not interpret; or empty.
    pub about: String,
}

impl Default for WriterOptions {
    fn default() -> WriterOptions {
        WriterOptions {
            compression: Compression::default(),
            filters: Vec::new(),
            durable: false,
            align: 1,
            volume: None,
            about: String::new(),
        }
    }
}

impl WriterOptions {
    /// Fails if a container cannot hold the texture, or if the options do not suit it.
    pub(super) fn check(&self, description: &Description) -> Result<(), String> {
        description::check(description)?;
        description::check_filters(description, &self.filters)?;
        self.volume.as_ref().map_or(Ok(()), |volume| volume.check(description))?;
        description::check_about(&self.about)?;
        description::check_align(self.align)
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// All tiles, constant and shared ones included.
    pub tiles: u64,
    /// Tiles of one colour, kept in the index.
    pub constant_tiles: u64,
    /// Tiles whose bytes are those of an earlier tile.
    pub shared_tiles: u64,
    /// Bytes of the file.
    pub bytes: u64,
}

/// Where the bytes of a tile go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Destination {
    /// The bytes are there already: another tile has the same.
    Known,
    /// The bytes stay in memory until the end.
    Memory,
    /// The bytes are appended to the file.
    File,
}

/// Writes one container. The file appears at its place when it is finished, and not before; a writer that is
/// dropped leaves nothing behind.
///
/// Takes 4 bytes a page and about 60 a distinct tile, and holds about 1 MiB of coarse tiles back until the
/// end.
#[derive(Debug)]
pub struct ContainerWriter<W> {
    out: W,
    name: String,
    description: Description,
    options: WriterOptions,
    description_section: Section,
    numbering: PageNumbering,
    records: Vec<Record>,
    record_of_content: FxHashMap<u128, u32>,
    pages: Vec<u32>,
    constants: Vec<u8>,
    /// The finest level that is held back, and what is held: first page, record, bytes.
    held_level: u8,
    held: Vec<(u64, u32, Bytes)>,
    /// Where the next bytes go.
    offset: u64,
    broken: bool,
    written: Written,
}

impl ContainerWriter<TempFile> {
    /// Begins a container that [`ContainerWriter::finish`] will put at `path`, over what is there.
    pub fn create(
        path: impl AsRef<Path>,
        description: Description,
        options: WriterOptions,
    ) -> Result<Self, WriteError> {
        let (path, name) = (path.as_ref(), path.as_ref().display().to_string());
        let out = TempFile::create(path).map_err(|error| WriteError::Io { name: name.clone(), error })?;
        ContainerWriter::new(out, name, description, options)
    }

    /// Begins a container as [`ContainerWriter::create`] does, but under the temporary name that all builds
    /// into the place share: while this one writes there, others are refused. Removes what an interrupted
    /// build left, unless `keeps_left` is true and the build could be resumed: then fails with
    /// [`WriteError::OtherBuild`].
    pub fn claim(
        path: impl AsRef<Path>,
        description: Description,
        options: WriterOptions,
        keeps_left: bool,
    ) -> Result<Self, WriteError> {
        let (path, name) = (path.as_ref(), path.as_ref().display().to_string());
        let failed = WriteError::io(&name);
        let mut out = TempFile::claim(path)
            .map_err(&failed)?
            .ok_or_else(|| WriteError::InUse { name: name.clone() })?;
        let journal = out.journal_path();
        if keeps_left && journal.exists() {
            return Err(WriteError::OtherBuild { name, of: "other options".to_owned() });
        }
        out.set_keep(false);
        // Where there is none, there is nothing to remove.
        let _ = std::fs::remove_file(journal);
        out.go_on_at(0).map_err(&failed)?;
        ContainerWriter::new(out, name, description, options)
    }

    /// The temporary name, which a program removes when it is interrupted.
    pub fn temp_path(&self) -> &Path {
        self.out.temp_path()
    }

    /// Writes what was held back, the index and the header, and puts the file in its place.
    pub fn finish(self) -> Result<Written, WriteError> {
        let (name, durable) = (self.name.clone(), self.options.durable);
        let (out, written) = self.complete()?;
        out.put_in_place(durable).map_err(|error| WriteError::Io { name, error })?;
        Ok(written)
    }
}

impl<W: Write + Seek> ContainerWriter<W> {
    /// Begins a container in `out`, which is empty; messages call it `name`.
    pub fn new(
        out: W,
        name: impl Into<String>,
        description: Description,
        options: WriterOptions,
    ) -> Result<Self, WriteError> {
        let name = name.into();
        if let Err(fault) = options.check(&description) {
            return Err(WriteError::Description { name, fault });
        }
        let numbering = PageNumbering::new(&description.geometry);
        let textures = options.volume.as_ref().map_or(1, ContainerVolume::textures);
        // A container has at most 2^31 pages, which was checked.
        let count = numbering.pages() * textures;
        let mut pages = Vec::new();
        if pages.try_reserve_exact(count as usize).is_err() {
            let fault = format!("{count} pages need more memory than there is; use larger pages");
            return Err(WriteError::Description { name, fault });
        }
        pages.resize(count as usize, NO_RECORD);
        let volume = options.volume.as_ref();
        let WriterOptions { filters, align, about, .. } = &options;
        let description_bytes = description::encode(&description, filters, *align, volume, about);
        let mut writer = ContainerWriter {
            out,
            name,
            options,
            description_section: Section::of(HEADER_BYTES, &description_bytes),
            records: Vec::new(),
            record_of_content: FxHashMap::default(),
            pages,
            numbering,
            constants: Vec::new(),
            held_level: held_level(&description, textures),
            held: Vec::new(),
            offset: 0,
            broken: false,
            written: Written::default(),
            description,
        };
        writer.put(&[0; HEADER_BYTES as usize])?;
        writer.put(&description_bytes)?;
        Ok(writer)
    }

    /// How many textures there are: 1, unless the container is of a volume.
    fn textures(&self) -> u64 {
        self.pages.len() as u64 / self.numbering.pages()
    }

    /// The texture being written.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Encodes and appends the texels of one tile: all layers, `description.tile_bytes()` bytes.
    pub fn write_tile(&mut self, pos: PagePos, texels: &[u8]) -> Result<(), WriteError> {
        let texels = Bytes::copy_from_slice(texels);
        let tile = EncodedTile::new(texels, &self.description, self.options.compression);
        self.append(pos, tile)
    }

    /// Appends a tile; each page once, in any order. Costs a look-up and a copy.
    pub fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        self.append_to(0, pos, tile)
    }

    /// Appends a tile of one of a volume's textures, by the texture's number; each page of each once, in any
    /// order.
    pub fn append_to(&mut self, texture: u64, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        self.add(texture, pos, tile, ContainerWriter::put)
    }

    /// Appends a tile whose bytes, if their destination is [`Destination::File`], are in the file already, at
    /// [`Self::offset`].
    pub(super) fn take_over(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        self.add(0, pos, tile, |writer, bytes| {
            writer.offset += bytes.len() as u64;
            Ok(())
        })
    }

    /// Appends a tile; `put` brings its bytes into the file.
    fn add(
        &mut self,
        texture: u64,
        pos: PagePos,
        tile: EncodedTile,
        put: impl Fn(&mut Self, &[u8]) -> Result<(), WriteError>,
    ) -> Result<(), WriteError> {
        let refuse = |fault: String| WriteError::Tile { name: self.name.clone(), pos, fault };
        let page = self.numbering.number_of(pos).filter(|_| texture < self.textures());
        let page = page.ok_or_else(|| refuse("there is no such page".into()))?;
        let page = texture * self.numbering.pages() + page;
        if self.pages[page as usize] != NO_RECORD {
            return Err(refuse("the page has a tile already".into()));
        }
        if tile.raw_len() != self.description.tile_bytes() {
            let expected = self.description.tile_bytes();
            return Err(refuse(format!("a tile of {} bytes where {expected} are expected", tile.raw_len())));
        }
        let shared = self.record_of_content.get(&tile.content()).copied();
        let codec = tile.tile().codec;
        self.written.tiles += 1;
        self.written.constant_tiles += u64::from(codec == Codec::Constant);
        self.written.shared_tiles += u64::from(shared.is_some() && codec != Codec::Constant);
        let number = match shared {
            Some(number) => number,
            None => self.add_record(pos.level, page, tile, put)?,
        };
        self.pages[page as usize] = number;
        Ok(())
    }

    fn add_record(
        &mut self,
        level: u8,
        page: u64,
        tile: EncodedTile,
        put: impl Fn(&mut Self, &[u8]) -> Result<(), WriteError>,
    ) -> Result<u32, WriteError> {
        // There are fewer records than pages, which are at most 2^31.
        let number = self.records.len() as u32;
        let (content, checksum) = (tile.content(), tile.checksum());
        let Tile { codec, bytes } = tile.into_tile();
        let destination = self.destination(level, content, codec);
        let extent = |offset| Extent { offset, len: bytes.len() as u64 };
        let extent = if codec == Codec::Constant {
            self.constants.extend_from_slice(&bytes);
            extent((self.constants.len() - bytes.len()) as u64)
        } else if destination == Destination::Memory {
            self.held.push((page, number, bytes.clone()));
            extent(0)
        } else {
            put(self, self.gap())?;
            put(self, &bytes)?;
            extent(self.offset - bytes.len() as u64)
        };
        self.records.push(Record { section: Section { extent, checksum }, codec });
        self.record_of_content.insert(content, number);
        Ok(number)
    }

    /// Where the bytes of the tile go that is appended next.
    pub(super) fn destination(&self, level: u8, hash: u128, codec: Codec) -> Destination {
        if self.record_of_content.contains_key(&hash) {
            Destination::Known
        } else if codec == Codec::Constant || level >= self.held_level {
            Destination::Memory
        } else {
            Destination::File
        }
    }

    /// The number of a page in the index, and true if it has a tile; `None` if there is no such page.
    pub(super) fn page(&self, pos: PagePos) -> Option<(u64, bool)> {
        let page = self.numbering.number_of(pos)?;
        Some((page, self.pages[page as usize] != NO_RECORD))
    }

    /// The page of a number.
    pub(super) fn pos(&self, page: u64) -> Option<PagePos> {
        self.numbering.pos_of(page)
    }

    /// Where the next bytes go.
    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    /// The zeros that stand before the next tile.
    pub(super) fn gap(&self) -> &'static [u8] {
        gap_before(self.offset, self.options.align)
    }

    /// What is written to.
    pub(super) fn out_mut(&mut self) -> &mut W {
        &mut self.out
    }

    /// Writes what was held back, the index and the header; returns `out`.
    pub fn complete(mut self) -> Result<(W, Written), WriteError> {
        let incomplete = |missing| WriteError::Incomplete { name: self.name.clone(), missing };
        if self.broken {
            return Err(incomplete("an earlier write failed"));
        }
        let first_pages = self.pages.iter().step_by(self.numbering.pages() as usize);
        if first_pages.into_iter().any(|page| *page == NO_RECORD) {
            return Err(incomplete("it has no tail; write the tile of the coarsest levels"));
        }
        let coarse_offset = self.offset;
        let mut held = std::mem::take(&mut self.held);
        held.sort_unstable_by_key(|(page, ..)| *page);
        for (_, number, bytes) in held {
            self.put(self.gap())?;
            self.records[number as usize].section.extent.offset = self.offset;
            self.put(&bytes)?;
        }
        let index_bytes = index::encode(&self.records, &[], &self.pages, &self.constants);
        let index = Section::of(self.offset, &index_bytes);
        self.put(&index_bytes)?;
        let (file_len, description) = (self.offset, self.description_section);
        self.put_header(&Header { sequence: 1, file_len, description, index, coarse_offset })?;
        self.written.bytes = file_len;
        Ok((self.out, self.written))
    }

    /// Writes both header copies, which are equal in a new file.
    fn put_header(&mut self, header: &Header) -> Result<(), WriteError> {
        let copies = header.encode().repeat(2);
        self.out
            .seek(SeekFrom::Start(0))
            .and_then(|_| self.out.write_all(&copies))
            .and_then(|()| self.out.flush())
            .map_err(|error| WriteError::Io { name: self.name.clone(), error })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        if let Err(error) = self.out.write_all(bytes) {
            self.broken = true;
            return Err(WriteError::Io { name: self.name.clone(), error });
        }
        self.offset += bytes.len() as u64;
        Ok(())
    }
}

/// The zeros between `offset` and the next multiple of `align`.
pub(super) fn gap_before(offset: u64, align: u32) -> &'static [u8] {
    static ZEROS: [u8; 64 << 10] = [0; 64 << 10];
    let gap = offset.next_multiple_of(u64::from(align)) - offset;
    &ZEROS[..gap as usize]
}

/// The finest level from which all that are coarser come to at most [`HELD_BYTES`], the tail not counted, of
/// all textures. No level is held back where the tails alone come to more than a reader keeps.
pub(super) fn held_level(description: &Description, textures: u64) -> u8 {
    let geometry = &description.geometry;
    let tail_level = geometry.tail().first_level();
    let tile_bytes = (description.tile_bytes() as u64).saturating_mul(textures);
    if textures > 1 && tile_bytes > MAX_COARSE_BYTES {
        return u8::MAX;
    }
    let mut bytes = 0;
    (0..tail_level)
        .rev()
        .take_while(|&level| {
            bytes += geometry.level(level).page_count() * tile_bytes;
            bytes <= HELD_BYTES
        })
        .last()
        .unwrap_or(tail_level)
}
