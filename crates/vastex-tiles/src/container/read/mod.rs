//! Reading a container: opened with two reads, then one read for each tile.
//!
//! No number of the file is trusted: whatever a range says, it must lie in the file and be no longer than a
//! tile. `info` counts what is in a container, `verify` checks every byte of one. What the bytes mean is the
//! business of `format`.

mod info;
mod verify;

use std::sync::{Arc, OnceLock};

use bytes::Bytes;
use vastex_core::{Description, PageContents, PageNumbering, PagePos, PageSet};

use super::format::description::{self, ContainerVolume, Contents, DescriptionFault};
use super::format::error::ContainerError;
use super::format::header::Header;
use super::format::index::{Index, Record};
use super::format::layout::{Extent, HEADER_BYTES, MAX_COARSE_BYTES, OPENING_BYTES, Section};
use crate::sources::{ReadError, ReadFuture, SourceKey, StoreCounter, Tiers, TileSource};
use crate::stores::{ReadLimit, Store, StoreError};
use crate::tile::{Codec, Tile};

pub use info::{Info, Saved};
#[cfg(not(target_family = "wasm"))]
pub use verify::verify_file;
pub use verify::{Fault, Verification, verify};

/// A `.vastex` container, open for reading.
///
/// Keeps 4 bytes a page, 24 a distinct tile, and the coarse tiles in memory, and one bit a page more if some
/// pages have no tile. A tile whose page has an ancestor without a tile counts as missing.
pub struct Container {
    store: Arc<dyn Store>,
    header: Header,
    description: Arc<Description>,
    filters: Vec<String>,
    align: u32,
    volume: Option<ContainerVolume>,
    about: String,
    index: Index,
    numbering: PageNumbering,
    /// The pages that have tiles, or `None` if all have.
    present: Option<Arc<PageSet>>,
    /// Which pages have the same record or constant; determined at the first call of `contents`.
    contents: OnceLock<Option<Arc<PageContents>>>,
    /// The bytes of the coarse tiles, from the header's `coarse_offset` on; empty if there are too many to
    /// keep.
    coarse: Bytes,
    reads: StoreCounter,
}

impl Container {
    /// Opens a container: one read for header and description, one for the coarse tiles and the index.
    ///
    /// If the description or the index of the newest version is damaged, the version before it is opened, if
    /// that is whole.
    pub async fn open(store: Arc<dyn Store>) -> Result<Container, ContainerError> {
        let opening = store.read(0, store.len().min(OPENING_BYTES) as usize).await?;
        let copies = &opening[..opening.len().min(HEADER_BYTES as usize)];
        let header = Header::newest(store.name(), copies, store.len())?;
        let error = match Container::open_version(store.clone(), header, &opening).await {
            Err(error @ ContainerError::Damaged { .. }) => error,
            opened => return opened,
        };
        let Some(before) = header.before(copies) else { return Err(error) };
        let Ok(container) = Container::open_version(store, before, &opening).await else { return Err(error) };
        tracing::warn!(%error, "the newest version is damaged, so the one before it is read");
        Ok(container)
    }

    /// Opens the version that a header describes; `opening` are the first bytes of the file.
    async fn open_version(
        store: Arc<dyn Store>,
        header: Header,
        opening: &Bytes,
    ) -> Result<Container, ContainerError> {
        let Contents { description, filters, align, volume, about } =
            read_description(&*store, &header, opening).await?;
        let numbering = PageNumbering::new(&description.geometry);
        let textures = volume.as_ref().map_or(1, ContainerVolume::textures);
        let (coarse, index) = read_coarse_and_index(&*store, &header, numbering.pages() * textures).await?;
        let present = index.lacks_pages().then(|| {
            let geometry = &description.geometry;
            let record = |pos| index.record_of_page(numbering.number_of(pos)?);
            Arc::new(PageSet::from_pages(geometry, |pos| record(pos).is_some()))
        });
        let description = Arc::new(description);
        Ok(Container {
            header,
            description,
            filters,
            align,
            volume,
            about,
            index,
            numbering,
            present,
            contents: OnceLock::new(),
            coarse,
            store,
            reads: StoreCounter::default(),
        })
    }

    /// Opens a local file.
    #[cfg(not(target_family = "wasm"))]
    pub fn open_file(path: impl AsRef<std::path::Path>) -> Result<Container, ContainerError> {
        let store = crate::stores::FileStore::open(path)?;
        pollster::block_on(Container::open(Arc::new(store)))
    }

    /// Returns true if a local file is a container of a volume, as far as its description says: one read,
    /// which leaves the index alone.
    #[cfg(not(target_family = "wasm"))]
    pub fn holds_volume(path: impl AsRef<std::path::Path>) -> bool {
        let Ok(store) = crate::stores::FileStore::open(path) else { return false };
        let described = pollster::block_on(async {
            let opening = store.read(0, store.len().min(OPENING_BYTES) as usize).await?;
            let copies = &opening[..opening.len().min(HEADER_BYTES as usize)];
            let header = Header::newest(store.name(), copies, store.len())?;
            read_description(&store, &header, &opening).await
        });
        described.is_ok_and(|contents| contents.volume.is_some())
    }

    /// Opens a local file whose tiles are read directly from the disk, at most `depth` (1 to 64) at a time.
    /// If tiles are not aligned to the disk's block, or the file system refuses direct reads, opens it as
    /// [`Container::open_file`] does; [`Container::is_direct`] tells which.
    ///
    /// A loader has threads for as many reads, in addition to the number that it is told to have.
    #[cfg(not(target_family = "wasm"))]
    pub fn open_file_direct(
        path: impl AsRef<std::path::Path>,
        depth: usize,
    ) -> Result<Container, ContainerError> {
        use crate::stores::{DirectStore, FileStore};

        let buffered = Arc::new(FileStore::open(path.as_ref())?);
        let mut container = pollster::block_on(Container::open(buffered.clone()))?;
        if container.align > 1 {
            let direct = DirectStore::beside(buffered, path.as_ref(), depth);
            if direct.block_bytes().is_some_and(|block| container.align >= block.get()) {
                container.store = Arc::new(direct);
            }
        }
        Ok(container)
    }

    /// Returns true if tiles are read past the system's page cache, as [`Store::is_direct`] says.
    pub fn is_direct(&self) -> bool {
        self.store.is_direct()
    }

    /// The name of the container in messages: a path or a URL.
    pub fn name(&self) -> &str {
        self.store.name()
    }

    /// The name of the filter that made the levels of each layer; empty if the file does not say.
    ///
    /// What a name means is the builder's business: a region of a texture can be replaced only if its filters
    /// are known.
    pub fn filters(&self) -> &[String] {
        &self.filters
    }

    /// Every tile in the file begins at a multiple of so many bytes; 1 if the file states no alignment.
    pub fn align(&self) -> u32 {
        self.align
    }

    /// The volume of whose channels and times the textures are, or `None` if there is one texture, of no
    /// volume. As a source of tiles the container is the first texture.
    pub fn volume(&self) -> Option<&ContainerVolume> {
        self.volume.as_ref()
    }

    /// What else is known of the texels, in lines of words that are the builder's business: how large they
    /// are, and where they lie. Empty if the file says nothing.
    pub fn about(&self) -> &str {
        &self.about
    }

    /// How many textures there are.
    pub(in crate::container) fn textures(&self) -> u64 {
        self.volume.as_ref().map_or(1, ContainerVolume::textures)
    }

    /// Fails if the container is of a volume.
    #[cfg(all(feature = "write", not(target_family = "wasm")))]
    pub(in crate::container) fn refuse_volume(&self, why: &str) -> Result<(), ContainerError> {
        match self.volume {
            Some(_) => Err(ContainerError::OfVolume { name: self.name().into(), what: why.into() }),
            None => Ok(()),
        }
    }

    /// Reads a tile of one of a volume's textures, by the texture's number; [`ReadError::NoSuchTile`] where
    /// there is none.
    pub async fn read_of(&self, texture: u64, pos: PagePos) -> Result<Tile, ReadError> {
        let page = self.number_of(pos).filter(|_| texture < self.textures());
        self.read_page(pos, page.map(|page| texture * self.numbering.pages() + page)).await
    }

    /// The texel of which all of a tile's are copies, if they are: known from the index, without a read.
    pub fn constant_of(&self, texture: u64, pos: PagePos) -> Option<Bytes> {
        let page = self.number_of(pos).filter(|_| texture < self.textures())?;
        let number = self.index.record_of_page(texture * self.numbering.pages() + page)?;
        self.index.constant_of(number)
    }

    /// The number of a page in the index, or `None` if the page does not exist.
    pub(in crate::container) fn number_of(&self, pos: PagePos) -> Option<u64> {
        self.numbering.number_of(pos)
    }

    async fn read_tile(&self, pos: PagePos) -> Result<Tile, ReadError> {
        if self.present.as_ref().is_some_and(|present| !present.contains(pos)) {
            return Err(ReadError::NoSuchTile { pos });
        }
        self.read_page(pos, self.number_of(pos)).await
    }

    /// Reads the tile of a page by its number in the index.
    async fn read_page(&self, pos: PagePos, page: Option<u64>) -> Result<Tile, ReadError> {
        let number =
            page.and_then(|page| self.index.record_of_page(page)).ok_or(ReadError::NoSuchTile { pos })?;
        let in_index = |fault| {
            let place = format!("{}: the index, record {number}", self.name());
            ReadError::Damaged { pos, place, fault }
        };
        let record = self.index.record(number).map_err(in_index)?;
        self.check_record(&record).map_err(in_index)?;
        let bytes = self.bytes_of(&record).await.map_err(|e| match e {
            StoreError::Read { name, offset, len, error } => {
                let place = format!("{name}: {}", Extent { offset, len: len as u64 });
                ReadError::Store { pos, place, error }
            }
            StoreError::Open { name, error } => ReadError::Store { pos, place: name, error },
        })?;
        record.section.check(&bytes).map_err(|fault| {
            let place = format!("{}: {}", self.name(), record.section.extent);
            ReadError::Damaged { pos, place, fault }
        })?;
        Ok(Tile { codec: record.codec, bytes })
    }

    /// Fails unless a record's range lies in the file and is no longer than a tile.
    pub(in crate::container) fn check_record(&self, record: &Record) -> Result<(), String> {
        let extent = record.section.extent;
        if record.codec == Codec::Constant {
            return self.index.constant(extent).map(drop);
        }
        if !extent.lies_within(HEADER_BYTES..self.header.file_len) {
            return Err(format!("{extent} lie outside the file of {} bytes", self.header.file_len));
        }
        if extent.len == 0 || extent.len > self.description.tile_bytes() as u64 {
            return Err(format!(
                "a tile of {} bytes, encoded in {}",
                self.description.tile_bytes(),
                extent.len
            ));
        }
        Ok(())
    }

    /// The bytes of a record that [`Container::check_record`] has passed.
    pub(in crate::container) async fn bytes_of(&self, record: &Record) -> Result<Bytes, StoreError> {
        let extent = record.section.extent;
        if record.codec == Codec::Constant {
            return Ok(self.index.constant(extent).unwrap_or_default());
        }
        let kept = self.header.coarse_offset..self.header.coarse_offset + self.coarse.len() as u64;
        if extent.lies_within(kept.clone()) {
            let first = (extent.offset - kept.start) as usize;
            return Ok(self.coarse.slice(first..first + extent.len as usize));
        }
        let bytes = self.store.read(extent.offset, extent.len as usize).await?;
        self.reads.note(extent.len);
        Ok(bytes)
    }
}

/// What changing a file in place needs to know of the version that is there.
#[cfg(all(feature = "write", not(target_family = "wasm")))]
impl Container {
    /// The header of the version that is read.
    pub(in crate::container) fn header(&self) -> &Header {
        &self.header
    }

    /// The index of the version that is read.
    pub(in crate::container) fn index(&self) -> &Index {
        &self.index
    }

    /// Where the bytes of the file lie.
    pub(in crate::container) fn store(&self) -> &Arc<dyn Store> {
        &self.store
    }
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for Container {
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        self.present.as_ref()
    }

    /// Determined from the index alone. Keeps 1 byte a page if at most 255 records are shared, else 2 or 4.
    fn contents(&self) -> Option<&Arc<PageContents>> {
        let contents = || self.index.contents(&self.description.geometry, &self.numbering).map(Arc::new);
        self.contents.get_or_init(contents).as_ref()
    }

    /// Follows from the description and the index, which has the checksum of every tile: copies of a file
    /// have one identity, and a file that was changed has another.
    fn identity(&self) -> Option<SourceKey> {
        let Header { description, index, .. } = &self.header;
        let sections = [description, index].map(|Section { extent, checksum }| [extent.len, *checksum]);
        Some(SourceKey::of(sections.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>()))
    }

    /// The limit of the store: for a file that is read directly, the `depth` with which it was opened.
    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        self.store.read_limit()
    }

    fn blocks(&self) -> bool {
        self.store.read_limit().is_some_and(|limit| limit.is_blocking())
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        tiers.store += self.reads.stats();
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(self.read_tile(pos))
    }

    /// Always `None`: the tiles that are kept from opening the file are not checked yet.
    fn at_hand(&self, _: PagePos) -> Option<Tile> {
        None
    }

    /// An open container goes on reading the version of the file that it opened.
    fn changed(&self, _: &vastex_core::Region) {}
}

impl std::fmt::Debug for Container {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Container")
            .field("name", &self.name())
            .field("header", &self.header)
            .finish_non_exhaustive()
    }
}

async fn read_description(
    store: &dyn Store,
    header: &Header,
    opening: &Bytes,
) -> Result<Contents, ContainerError> {
    let Section { extent, .. } = header.description;
    let place = format!("the description, {extent}");
    // The header was checked: the range lies in the file, and its length is bounded.
    let bytes = if extent.lies_within(0..opening.len() as u64) {
        opening.slice(extent.offset as usize..(extent.offset + extent.len) as usize)
    } else {
        store.read(extent.offset, extent.len as usize).await?
    };
    header
        .description
        .check(&bytes)
        .map_err(|fault| ContainerError::damaged(store.name(), &place, &fault))?;
    description::decode(&bytes).map_err(|fault| match fault {
        DescriptionFault::Damaged(fault) => ContainerError::damaged(store.name(), &place, &fault),
        DescriptionFault::Unsupported(what) => {
            ContainerError::Unsupported { name: store.name().into(), what }
        }
    })
}

/// The coarse tiles, unless they are too many to keep, and the index.
async fn read_coarse_and_index(
    store: &dyn Store,
    header: &Header,
    pages: u64,
) -> Result<(Bytes, Index), ContainerError> {
    let Section { extent, .. } = header.index;
    let coarse_len = extent.offset - header.coarse_offset;
    let kept_len = if coarse_len <= MAX_COARSE_BYTES { coarse_len } else { 0 };
    let damaged =
        |fault: String| ContainerError::damaged(store.name(), &format!("the index, {extent}"), &fault);
    let longest = Index::longest(pages, extent.offset);
    if extent.len > longest {
        return Err(damaged(format!("an index of {pages} pages has at most {longest} bytes")));
    }
    let len = usize::try_from(kept_len + extent.len).map_err(|e| damaged(e.to_string()))?;
    let mut bytes = store.read(extent.offset - kept_len, len).await?;
    let coarse = bytes.split_to(kept_len as usize);
    header.index.check(&bytes).map_err(damaged)?;
    Ok((coarse, Index::new(bytes, pages).map_err(damaged)?))
}
