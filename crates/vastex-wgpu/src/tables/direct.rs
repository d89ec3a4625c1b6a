//! The direct tables of a pool: an arena of entries in GPU memory, written as its directory says.

use std::collections::BTreeMap;

use vastex_core::{ChangeRule, TableChange, TextureNumber};

use super::batch::Batch;
use super::changer::{Before, PoolTableChanger, Room, TableBuffer};
use super::directory::{DirectTable, Directory};
use super::word_texture::WordTexture;
use super::{Placement, PoolApplied, Resident};
use crate::arena::Arena;
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;

/// Entries of the first arena: 4 KiB.
const FIRST_ENTRIES: u32 = 1024;

/// The direct tables of a pool: an arena of entries in GPU memory.
#[derive(Debug)]
pub(super) struct DirectTables {
    pub(super) directory: Directory,
    memory: Memory,
    /// The memory is another than what was last submitted.
    is_moved: bool,
    /// Entries of arenas that are written to no more perhaps, but which commands may see until the next
    /// update.
    left: Vec<u32>,
}

/// Where the entries lie, and where they lay before.
#[derive(Debug)]
enum Memory {
    Buffer { buffer: TableBuffer, before: Vec<Before<TableBuffer>>, room: Room },
    Texture { texture: WordTexture, before: Vec<Before<WordTexture>> },
}

/// What the textures of a frame's changes come to.
struct Due<'a> {
    texture: TextureNumber,
    changes: &'a [TableChange],
    /// What is resident, where there are entries that nothing was written to.
    resident: Vec<TableChange>,
}

impl DirectTables {
    pub(super) fn new(device: &wgpu::Device, mode: FeedbackMode) -> Result<DirectTables, GpuError> {
        let most = u32::try_from(DirectTables::most_entries(device, mode)).unwrap_or(Arena::MOST);
        let memory = match mode {
            FeedbackMode::Raw => {
                let texture = WordTexture::new(device, FIRST_ENTRIES)?;
                Memory::Texture { texture, before: Vec::new() }
            }
            _ => {
                let buffer = TableBuffer::new(device, u64::from(FIRST_ENTRIES.min(most)))?;
                Memory::Buffer { buffer, before: Vec::new(), room: Room::default() }
            }
        };
        let capacity = match &memory {
            Memory::Texture { texture, .. } => texture.len(),
            Memory::Buffer { .. } => FIRST_ENTRIES,
        };
        let directory = Directory::new(Arena::new(capacity, most));
        Ok(DirectTables { directory, memory, is_moved: false, left: Vec::new() })
    }

    pub(super) fn most_entries(device: &wgpu::Device, mode: FeedbackMode) -> u64 {
        let limits = device.limits();
        let words = match mode {
            FeedbackMode::Raw => WordTexture::most_words(device),
            _ => limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 4,
        };
        // A power of two is what an arena has.
        words.checked_ilog2().map_or(0, |log| 1 << log).min(u64::from(Arena::MOST))
    }

    /// See [`super::PoolTables::apply`]. `is_anew`: nothing of what was written last time was submitted.
    #[expect(clippy::too_many_arguments, reason = "the device's three, and what a frame brings")]
    pub(super) fn apply(
        &mut self,
        changer: &PoolTableChanger,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        changes: &[TableChange],
        resident: &mut Resident<'_>,
        budget: &mut u64,
        is_anew: bool,
    ) -> Result<PoolApplied, GpuError> {
        if is_anew {
            self.directory.forget_written();
        }
        let due = self.due(changes, resident);
        self.move_to_larger(device, encoder)?;
        let bytes = match &mut self.memory {
            Memory::Buffer { buffer, before, room } => {
                let batch = batch_of(&self.directory, &due);
                match &changer.pipelines {
                    Some(pipelines) if !batch.is_empty() => {
                        let sent = room.send(device, queue, &batch.words())?;
                        let [fills, evictions, loads] = batch.chunks();
                        let steps = [
                            (&pipelines.fill, fills),
                            (&pipelines.evict, evictions),
                            (&pipelines.load, loads),
                        ];
                        let before = before.iter_mut().map(|before| &mut before.memory);
                        for table in std::iter::once(buffer).chain(before) {
                            room.carry_out(pipelines, device, encoder, table, &steps);
                        }
                        sent
                    }
                    _ => 0,
                }
            }
            Memory::Texture { texture, before } => {
                change_words(&mut self.directory, texture, &due, is_anew);
                show_more(&mut self.directory, texture, budget);
                let before: Vec<&WordTexture> = before.iter().map(|before| &before.memory).collect();
                texture.send(device, encoder, &before)?
            }
        };
        let mut placed = Vec::new();
        for texture in std::mem::take(&mut self.directory.touched) {
            let Some(table) = self.directory.tables.get_mut(&texture) else { continue };
            table.ranges.iter_mut().for_each(|level| level.is_fresh = false);
            if std::mem::take(&mut table.is_placed) {
                placed.push(texture);
            }
        }
        Ok(PoolApplied { bytes, moved: self.is_moved, placed })
    }

    /// Lets tables grow to what is loaded, and finds what is to be written to each.
    fn due<'a>(&mut self, changes: &'a [TableChange], resident: &mut Resident<'_>) -> Vec<Due<'a>> {
        let mut due: BTreeMap<TextureNumber, &[TableChange]> = BTreeMap::new();
        for changes in changes.chunk_by(|a, b| a.page.texture() == b.page.texture()) {
            let texture = changes[0].page.texture();
            due.insert(texture, changes);
            let loads = changes.iter().filter(|change| change.rule == ChangeRule::Coarser);
            if let Some(finest) = loads.map(|change| change.page.level()).min() {
                self.directory.grow(texture, finest);
            }
        }
        self.directory.touched.iter().for_each(|&texture| {
            due.entry(texture).or_default();
        });
        let mut all = Vec::with_capacity(due.len());
        for (texture, mut changes) in due {
            let Some(table) = self.directory.tables.get(&texture) else { continue };
            let mut loaded = Vec::new();
            if table.coarsest_fresh().is_some() {
                resident(texture, &mut loaded);
            }
            if table.is_fresh() {
                changes = &[]; // what is resident has them
            }
            if !changes.is_empty() || table.coarsest_fresh().is_some() {
                all.push(Due { texture, changes, resident: loaded });
            }
        }
        all
    }

    /// Takes larger memory where the directory's arena has doubled.
    fn move_to_larger(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<(), GpuError> {
        let entries = self.directory.arena.capacity();
        match &mut self.memory {
            Memory::Buffer { buffer, before, .. } => {
                let (size, wanted) = (buffer.buffer.size(), u64::from(entries) * 4);
                if size < wanted {
                    let larger = TableBuffer::new(device, u64::from(entries))?;
                    encoder.copy_buffer_to_buffer(&buffer.buffer, 0, &larger.buffer, 0, size);
                    before.push(Before::new(std::mem::replace(buffer, larger)));
                    self.is_moved = true;
                }
            }
            Memory::Texture { texture, before } => {
                if texture.len() < entries {
                    let larger = texture.enlarged(device, encoder, entries)?;
                    before.push(Before::new(std::mem::replace(texture, larger)));
                    self.is_moved = true;
                }
            }
        }
        Ok(())
    }

    pub(super) fn submitted(&mut self) {
        self.is_moved = false;
    }

    pub(super) fn count_update(&mut self) {
        self.left = self.followed();
        match &mut self.memory {
            Memory::Buffer { before, .. } => Before::count(before),
            Memory::Texture { before, .. } => Before::count(before),
        }
    }

    /// See [`super::PoolTables::placement`].
    pub(super) fn placement(&self, texture: TextureNumber) -> Placement {
        let table = self.directory.tables.get(&texture);
        let former = || [self.followed(), self.left.clone()].concat();
        table.map_or_else(|| Placement::without_entries(0), |table| table.placement(&former()))
    }

    /// Entries of the arenas in which the tables lay before, and which are still written to.
    fn followed(&self) -> Vec<u32> {
        match &self.memory {
            Memory::Buffer { before, .. } => {
                before.iter().map(|before| (before.memory.buffer.size() / 4) as u32).collect()
            }
            Memory::Texture { before, .. } => before.iter().map(|before| before.memory.len()).collect(),
        }
    }

    /// Returns true if no level is still on its way.
    pub(super) fn is_settled(&self) -> bool {
        self.directory.hidden.is_empty()
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.memory {
            Memory::Buffer { buffer, .. } => buffer.buffer.as_entire_binding(),
            Memory::Texture { texture, .. } => wgpu::BindingResource::TextureView(texture.view()),
        }
    }

    pub(super) fn buffer(&self) -> Option<&wgpu::Buffer> {
        match &self.memory {
            Memory::Buffer { buffer, .. } => Some(&buffer.buffer),
            Memory::Texture { .. } => None,
        }
    }

    pub(super) fn texture(&self) -> Option<&wgpu::Texture> {
        match &self.memory {
            Memory::Buffer { .. } => None,
            Memory::Texture { texture, .. } => Some(texture.texture()),
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        match &self.memory {
            Memory::Buffer { buffer, before, .. } => {
                let before = before.iter().map(|before| before.memory.buffer.size()).sum::<u64>();
                buffer.buffer.size() + before
            }
            Memory::Texture { texture, before } => {
                texture.bytes() + before.iter().map(|before| before.memory.bytes()).sum::<u64>()
            }
        }
    }
}

/// What the GPU is to do for these textures.
fn batch_of(directory: &Directory, due: &[Due<'_>]) -> Batch {
    let mut batch = Batch::default();
    for Due { texture, changes, resident } in due {
        let Some(table) = directory.tables.get(texture) else { continue };
        for level in table.ranges.iter().filter(|level| level.is_fresh) {
            batch.fill(level.range.first, level.entries, table.tail.to_bits());
        }
        batch.change(table, changes, u8::MAX);
        if let Some(coarsest) = table.coarsest_fresh() {
            batch.change(table, resident, coarsest);
        }
    }
    batch
}

/// The same done by the CPU. The levels by which a table grows are hidden, to be sent by and by; what is
/// written anew or elsewhere is not.
fn change_words(directory: &mut Directory, texture: &mut WordTexture, due: &[Due<'_>], is_anew: bool) {
    if is_anew {
        texture.mark_all();
    }
    for Due { texture: of, changes, resident } in due {
        let Some(table) = directory.tables.get_mut(of) else { continue };
        let tail = table.tail.to_bits();
        // Of the range that a table begins with all is sent at once.
        let grows = std::iter::once(false).chain(std::iter::repeat(true));
        for (level, grows) in table.ranges.iter_mut().zip(grows).filter(|(level, _)| level.is_fresh) {
            texture.unhide(level.range.first, level.range.entries());
            let is_new = std::mem::take(&mut level.is_new);
            level.is_hidden = grows && is_new && texture.hide(level.range.first, level.range.entries());
            texture.change(level.range.first, level.entries, |_| tail);
            texture.mark(level.range.first, level.entries);
        }
        match table.ranges.iter().any(|level| level.is_hidden) {
            true => directory.hidden.insert(*of),
            false => directory.hidden.remove(of),
        };
        apply_to_words(table, texture, changes, u8::MAX);
        if let Some(coarsest) = table.coarsest_fresh() {
            apply_to_words(table, texture, resident, coarsest);
        }
    }
}

/// Evictions, then loads, of the levels up to `coarsest`.
fn apply_to_words(table: &DirectTable, texture: &mut WordTexture, changes: &[TableChange], coarsest: u8) {
    let is_eviction = |change: &&TableChange| change.rule != ChangeRule::Coarser;
    let (evictions, loads): (Vec<&TableChange>, Vec<&TableChange>) = changes.iter().partition(is_eviction);
    for change in evictions.into_iter().chain(loads) {
        let (pos, entry) = (change.page.pos(table.geometry.dims()), change.entry.to_bits());
        table.rows_below(pos, coarsest, |first, count| {
            texture.change(first, count, |word| match change.rule {
                ChangeRule::Coarser => word.min(entry),
                ChangeRule::Naming(old) if word == old.to_bits() => entry,
                ChangeRule::Naming(_) => word,
            });
        });
    }
}

/// Sends more of the levels that are hidden, coarse ones first, and shows those of which nothing is left.
fn show_more(directory: &mut Directory, texture: &mut WordTexture, budget: &mut u64) {
    let Directory { tables, hidden, touched, .. } = directory;
    hidden.retain(|of| {
        let Some(table) = tables.get_mut(of) else { return false };
        for level in table.ranges.iter_mut().filter(|level| level.is_hidden) {
            if !texture.show(level.range.first, level.range.entries(), budget) {
                return true;
            }
            level.is_hidden = false;
            table.is_placed = true;
            touched.insert(*of);
        }
        false
    });
}
