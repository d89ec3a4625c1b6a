//! Page tables in GPU memory, of one texture each, direct or hashed.
//!
//! They lie in storage buffers or, where there are none, in textures (`table_texture`). How a frame's changes get there is
//! `table_changer`'s business.

use vastex_core::{
    Geometry, HashedBucket, HashedTable, LevelRule, PageNumbering, Slot, TableEntry, TableImage, TextureId,
};

use crate::device::{alive, guarded, storage, uniform};
use crate::error::GpuError;
use crate::mirror::{TableParams, TextureParams};
use crate::shader::TableKinds;
use crate::table_changer::ChangeBuffer;
use crate::table_growth::Growth;
use crate::table_texture::TableTexture;
use crate::way::FeedbackWay;

/// Entries that a direct table has from the beginning, where a level has no more.
const FEW_ENTRIES: u64 = 1024;
/// Bytes of a place of a hashed table.
const PLACE_BYTES: usize = 4 * HashedBucket::WORDS;

/// Which kind of page table a texture gets. Pictures are the same with either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TableChoice {
    /// A direct one up to 4 Mi entries and what the device allows, else a hashed one.
    #[default]
    BySize,
    /// An entry for each page: one read for each lookup.
    Direct,
    /// A hash table of the pages that are resident: its memory is that of the pool's slots, whatever the texture's size; a lookup
    /// reads a few words where the wanted page is resident, and as many again for each level upward where it is not.
    Hashed,
}

impl TableChoice {
    /// The kind that a texture of this shape gets on a device: direct or hashed.
    pub fn on(self, device: &wgpu::Device, geometry: &Geometry, way: FeedbackWay) -> TableChoice {
        match self.is_hashed(device, geometry, way) {
            true => TableChoice::Hashed,
            false => TableChoice::Direct,
        }
    }

    /// What a shader reads of textures of this kind.
    pub fn kinds(self) -> TableKinds {
        match self {
            TableChoice::BySize => TableKinds::Either,
            TableChoice::Direct => TableKinds::Direct,
            TableChoice::Hashed => TableKinds::Hashed,
        }
    }

    fn is_hashed(self, device: &wgpu::Device, geometry: &Geometry, way: FeedbackWay) -> bool {
        let is_large = || {
            let entries = entry_count(geometry, 0);
            entries > TableImage::MOST_ENTRIES || entries * 4 > most_bytes(device, way)
        };
        self == TableChoice::Hashed || self == TableChoice::BySize && is_large()
    }
}

/// The page table and the parameters of one texture.
#[derive(Debug)]
pub struct TableBuffers {
    pub(crate) geometry: Geometry,
    texture: TextureId,
    tail_slot: Slot,
    rule: LevelRule,
    pub(crate) kind: Kind,
    params: wgpu::Buffer,
    pub(crate) entries: Entries,
    pub(crate) changes: Option<ChangeBuffer>,
    pub(crate) growth: Growth,
}

/// Where the entries lie.
#[derive(Debug)]
pub(crate) enum Entries {
    Buffer(wgpu::Buffer),
    Texture(TableTexture),
}

/// How the entries lie there.
#[derive(Debug)]
pub(crate) enum Kind {
    /// One for each page of the levels from `begin` on, of which those from `finest` on are filled; `image` has those of all levels where the
    /// CPU changes them.
    Direct { finest: u8, begin: u8, image: Option<Box<TableImage>> },
    /// As the places of this table, which the GPU has a copy of.
    Hashed(Box<HashedTable>),
}

impl TableBuffers {
    /// A table in which every entry leads to the tail, which lies in `tail_slot`, of a texture without a bias of
    /// its own, for shaders made for a way of feedback. A direct one has entries for the coarse levels only, some hundreds; before a finer page is loaded it must
    /// [grow](crate::TableChanger::grow).
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        geometry: &Geometry,
        texture: TextureId,
        tail_slot: Slot,
        choice: TableChoice,
        way: FeedbackWay,
    ) -> Result<TableBuffers, GpuError> {
        alive(device)?;
        TableBuffers::check(device, geometry, choice, way)?;
        let is_in_texture = way == FeedbackWay::Raw;
        let image = || Box::new(TableImage::new(geometry, tail_slot));
        let kind = match choice.is_hashed(device, geometry, way) {
            true => Kind::Hashed(Box::new(HashedTable::new(geometry, tail_slot))),
            false => Kind::direct(coarse_level(geometry), is_in_texture.then(image)),
        };
        let growth = Growth::to(kind.finest());
        let entries = Entries::new(device, kind.bytes(geometry), is_in_texture)?;
        let rule = LevelRule::default().within(geometry);
        let params = TextureParams::new(geometry, texture, tail_slot, &rule, kind.params());
        let params = uniform(device, queue, "vastex texture", &params);
        let geometry = geometry.clone();
        let changes = None;
        let mut table =
            TableBuffers { geometry, texture, tail_slot, rule, kind, params, entries, changes, growth };
        table.send_all(queue);
        Ok(table)
    }

    /// Whether there are entries for the pages of a level, or will be: see [`TableBuffers::is_growing`].
    pub fn has_level(&self, level: u8) -> bool {
        level >= self.growth.level()
    }

    /// Takes another buffer or texture, and other parameters, for a table with `tail_slot` and, where it is direct, entries from level
    /// `finest` on, in which every entry leads to the tail; they are to be filled. Gives the table as it lay before: what was recorded with
    /// that keeps it. Where it fails everything stays as it is.
    pub(crate) fn lie_anew(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tail_slot: Slot,
        finest: u8,
    ) -> Result<TableBuffers, GpuError> {
        let kind = match &self.kind {
            Kind::Direct { image, .. } => {
                let anew = || Box::new(TableImage::new(&self.geometry, tail_slot));
                Kind::direct(finest, image.is_some().then(anew))
            }
            Kind::Hashed(_) => Kind::Hashed(Box::new(HashedTable::new(&self.geometry, tail_slot))),
        };
        self.lie_elsewhere(device, queue, tail_slot, kind)
    }

    /// Moves the table to memory of its own for a table of this kind, and returns the former one. What `kind` holds is what the table holds then.
    pub(crate) fn lie_elsewhere(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tail_slot: Slot,
        kind: Kind,
    ) -> Result<TableBuffers, GpuError> {
        alive(device)?;
        let is_in_texture = matches!(self.entries, Entries::Texture(_));
        let entries = Entries::new(device, kind.bytes(&self.geometry), is_in_texture)?;
        Ok(self.take_place(device, queue, entries, kind, tail_slot))
    }

    /// Replaces the table's memory and contents, and returns the former ones.
    pub(crate) fn take_place(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        entries: Entries,
        kind: Kind,
        tail_slot: Slot,
    ) -> TableBuffers {
        use std::mem::replace;
        let growth = Growth::to(kind.finest());
        let kind = replace(&mut self.kind, kind);
        let tail_slot = replace(&mut self.tail_slot, tail_slot);
        let params = uniform(device, queue, "vastex texture", &self.texture_params());
        TableBuffers {
            geometry: self.geometry.clone(),
            texture: self.texture,
            rule: self.rule,
            kind,
            tail_slot,
            params: replace(&mut self.params, params),
            entries: replace(&mut self.entries, entries),
            changes: self.changes.take(), // its bind group names what was there
            growth: replace(&mut self.growth, growth),
        }
    }

    /// A hashed table whose places have become others, which were `before`, lies elsewhere; gives what lies where it lay.
    pub(crate) fn hash_elsewhere(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        before: HashedTable,
    ) -> Result<TableBuffers, GpuError> {
        let now = std::mem::replace(&mut self.kind, Kind::Hashed(Box::new(before)));
        self.lie_elsewhere(device, queue, self.tail_slot, now)
    }

    /// The finest level that shaders look up: all of its entries are there. 0 of a hashed table.
    pub fn finest(&self) -> u8 {
        self.kind.finest()
    }

    /// Sends all of a table that nothing reads yet, for all commands submitted after this call.
    pub(crate) fn send_all(&mut self, queue: &wgpu::Queue) -> u64 {
        if let Kind::Hashed(table) = &mut self.kind {
            table.take_written(); // all of it goes
        }
        let count = self.kind.bytes(&self.geometry) / 4;
        let words = self.kind.words(&self.geometry, self.tail_slot);
        match &mut self.entries {
            Entries::Buffer(buffer) => {
                queue.write_buffer(buffer, 0, bytemuck::cast_slice(&words.range(0..count)));
                count * 4
            }
            Entries::Texture(texture) => texture.write_all(queue, &words),
        }
    }

    /// Records the rows of a table in a texture in which something has changed; returns their bytes.
    pub(crate) fn send_marked(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) -> u64 {
        let words = self.kind.words(&self.geometry, self.tail_slot);
        match &mut self.entries {
            Entries::Buffer(_) => 0,
            Entries::Texture(texture) => texture.send(device, encoder, &words),
        }
    }

    /// Sets how levels are chosen, as far as the texture has them, for all commands submitted after this call: sampling
    /// and feedback alike.
    pub fn set_rule(&mut self, queue: &wgpu::Queue, rule: LevelRule) {
        self.rule = rule.within(&self.geometry);
        self.send_params(queue);
    }

    fn send_params(&self, queue: &wgpu::Queue) {
        let params = self.texture_params();
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
    }

    /// How levels are chosen.
    pub fn rule(&self) -> LevelRule {
        self.rule
    }

    /// Whether the page table of a texture fits this device; the only thing about a texture that [`TableBuffers::new`] refuses. A
    /// hashed one always does.
    pub fn check(
        device: &wgpu::Device,
        geometry: &Geometry,
        choice: TableChoice,
        way: FeedbackWay,
    ) -> Result<(), GpuError> {
        let entries = entry_count(geometry, 0);
        let (bytes, max) = (entries * 4, most_bytes(device, way));
        match choice.is_hashed(device, geometry, way) || bytes <= max {
            true => Ok(()),
            false => Err(GpuError::TableTooLarge { entries, bytes, max }),
        }
    }

    /// The hash table that the GPU has a copy of, where it is that kind.
    pub fn hashed(&self) -> Option<&HashedTable> {
        match &self.kind {
            Kind::Direct { .. } => None,
            Kind::Hashed(table) => Some(table),
        }
    }

    /// Of a direct table the entries, one `u32` each ([`TableEntry::to_bits`]) in the order of [`PageNumbering`]; of a hashed one the
    /// [words](HashedBucket::words) of its places. Can be copied from; nothing where they lie in a texture.
    pub fn entries(&self) -> Option<&wgpu::Buffer> {
        match &self.entries {
            Entries::Buffer(buffer) => Some(buffer),
            Entries::Texture(_) => None,
        }
    }

    /// The texture in which they lie, row after row, where it is one. Can be copied from.
    pub fn texture(&self) -> Option<&wgpu::Texture> {
        match &self.entries {
            Entries::Buffer(_) => None,
            Entries::Texture(texture) => Some(texture.texture()),
        }
    }

    /// The entries as shaders see them.
    pub(crate) fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.entries {
            Entries::Buffer(buffer) => buffer.as_entire_binding(),
            Entries::Texture(texture) => wgpu::BindingResource::TextureView(texture.view()),
        }
    }

    /// GPU memory of the table, of the larger one that it is to lie in if there is one, and of the parameters; what changes are sent
    /// through comes on top.
    pub fn bytes(&self) -> u64 {
        let entries = match &self.entries {
            Entries::Buffer(buffer) => buffer.size(),
            Entries::Texture(texture) => texture.bytes(),
        };
        entries + self.growth.bytes() + self.params.size()
    }

    pub(crate) fn tail_slot(&self) -> Slot {
        self.tail_slot
    }

    /// What of its parameters may change.
    pub(crate) fn changeable(&self) -> (LevelRule, Slot, TableParams) {
        (self.rule, self.tail_slot, self.kind.params())
    }

    pub(crate) fn texture_params(&self) -> TextureParams {
        TextureParams::new(&self.geometry, self.texture, self.tail_slot, &self.rule, self.kind.params())
    }

    pub(crate) fn params(&self) -> &wgpu::Buffer {
        &self.params
    }
}

impl Entries {
    fn new(device: &wgpu::Device, bytes: u64, is_in_texture: bool) -> Result<Entries, GpuError> {
        guarded(device, bytes, || match is_in_texture {
            true => Entries::Texture(TableTexture::new(device, bytes)),
            false => Entries::Buffer(storage(device, "vastex page table", bytes)),
        })
    }
}

impl Kind {
    /// Of entries that are all filled.
    fn direct(finest: u8, image: Option<Box<TableImage>>) -> Kind {
        Kind::Direct { finest, begin: finest, image }
    }

    fn finest(&self) -> u8 {
        match self {
            Kind::Direct { finest, .. } => *finest,
            Kind::Hashed(_) => 0,
        }
    }

    /// The words of the table; those of a direct table that only the GPU has lead to the tail, as at its beginning.
    pub(crate) fn words(&self, geometry: &Geometry, tail_slot: Slot) -> Words<'_> {
        match self {
            Kind::Direct { begin, image: Some(image), .. } => Words::of(image, geometry, *begin),
            Kind::Direct { image: None, .. } => {
                Words::Tail(TableEntry::new(geometry.tail().first_level(), tail_slot).to_bits())
            }
            Kind::Hashed(table) => Words::Places(table.buckets()),
        }
    }

    fn params(&self) -> TableParams {
        match self {
            Kind::Direct { finest, begin, .. } => TableParams::Direct { finest: *finest, begin: *begin },
            Kind::Hashed(table) => {
                TableParams::Hashed { places: table.buckets().len() as u32, seed: table.seed() }
            }
        }
    }

    pub(crate) fn bytes(&self, geometry: &Geometry) -> u64 {
        match self {
            Kind::Direct { begin, .. } => entry_count(geometry, *begin) * 4,
            Kind::Hashed(table) => (table.buckets().len() * PLACE_BYTES) as u64,
        }
    }
}

/// What a table holds, word by word.
pub(crate) enum Words<'a> {
    Image(&'a [TableEntry]),
    Tail(u32),
    Places(&'a [HashedBucket]),
}

impl<'a> Words<'a> {
    /// The entries of an image from a level on.
    pub(crate) fn of(image: &'a TableImage, geometry: &Geometry, begin: u8) -> Words<'a> {
        Words::Image(&image.entries()[first_entry(geometry, begin) as usize..])
    }

    /// Some of them, and zeros beyond the last, where nobody looks.
    pub(crate) fn range(&self, range: std::ops::Range<u64>) -> Vec<u32> {
        let (begin, count) = (range.start as usize, (range.end - range.start) as usize);
        let mut words: Vec<u32> = match self {
            Words::Tail(tail) => vec![*tail; count],
            Words::Image(entries) => {
                entries.iter().skip(begin).take(count).map(|entry| entry.to_bits()).collect()
            }
            Words::Places(places) => {
                let first = begin / HashedBucket::WORDS;
                let words = places.iter().skip(first).flat_map(|place| place.words());
                words.skip(begin % HashedBucket::WORDS).take(count).collect()
            }
        };
        words.resize(count, 0);
        words
    }
}

/// Bytes of the largest table that shaders may read.
fn most_bytes(device: &wgpu::Device, way: FeedbackWay) -> u64 {
    if way == FeedbackWay::Raw {
        return TableTexture::most_bytes(device);
    }
    let limits = device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// Entries of a texture's table from a level on. A binding is never empty, so a texture that is all tail has one that nobody reads.
pub(crate) fn entry_count(geometry: &Geometry, finest: u8) -> u64 {
    (PageNumbering::new(geometry).entries() - first_entry(geometry, finest)).max(1)
}

/// The first of them.
pub(crate) fn first_entry(geometry: &Geometry, finest: u8) -> u64 {
    let is_finer = finest < geometry.tail().first_level();
    if is_finer { PageNumbering::new(geometry).first_entry(finest) } else { 0 }
}

/// The finest level that a table begins with: one of few entries.
fn coarse_level(geometry: &Geometry) -> u8 {
    let finer_than_tail = 0..geometry.tail().first_level();
    let few = finer_than_tail.clone().find(|&level| entry_count(geometry, level) <= FEW_ENTRIES);
    few.or(finer_than_tail.last()).unwrap_or(0)
}
