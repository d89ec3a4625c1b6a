//! The hashed tables of a pool: one hash table in GPU memory, a copy of the CPU's.

use vastex_core::{HashedBucket, HashedTable, TableChange, TextureNumber};

use super::changer::{Before, PoolTableChanger, Room, TableBuffer, chunks};
use super::word_texture::WordTexture;
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;

/// One hash table in GPU memory for all textures of a pool, a copy of the CPU's.
#[derive(Debug)]
pub(super) struct HashedTables {
    now: Copied,
    before: Vec<Before<Copied>>,
    /// True if the table lies elsewhere than what was last submitted.
    is_moved: bool,
    /// Pages for which it has room from the beginning.
    pages: usize,
}

/// A hash table, and the GPU's copy of it.
#[derive(Debug)]
struct Copied {
    table: HashedTable,
    memory: Memory,
}

#[derive(Debug)]
enum Memory {
    Buffer { buffer: TableBuffer, room: Room },
    Texture(WordTexture),
}

impl HashedTables {
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mode: FeedbackMode,
        slots: u32,
    ) -> Result<HashedTables, GpuError> {
        let pages = slots as usize;
        let now = Copied::new(device, queue, HashedTable::new(pages), mode == FeedbackMode::Raw)?;
        Ok(HashedTables { now, before: Vec::new(), is_moved: false, pages })
    }

    pub(super) fn remove(&mut self, texture: TextureNumber) {
        self.now.table.remove_texture(texture);
        self.before.iter_mut().for_each(|before| before.memory.table.remove_texture(texture));
    }

    /// Of a texture nothing is resident but what `resident` names.
    pub(super) fn begin_anew(&mut self, texture: TextureNumber, resident: &[TableChange]) {
        self.remove(texture);
        self.now.table.load(resident);
    }

    /// Everything begins anew, elsewhere.
    pub(super) fn forget_all(&mut self) {
        self.now.table = HashedTable::new(self.pages);
    }

    /// Carries out changes, evictions before loads; `is_anew`: all that the table holds goes to other memory,
    /// and nothing that was written before is followed any more.
    pub(super) fn apply(
        &mut self,
        changer: &PoolTableChanger,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        changes: &[TableChange],
        is_anew: bool,
    ) -> Result<u64, GpuError> {
        self.now.table.apply(changes);
        self.before.iter_mut().for_each(|before| before.memory.table.evict(changes));
        let former = self.now.table.take_before();
        let mut bytes = 0;
        if former.is_some() || is_anew {
            let is_in_texture = matches!(self.now.memory, Memory::Texture(_));
            let larger = Copied::new(device, queue, self.now.table.clone(), is_in_texture)?;
            bytes += larger.bytes();
            let mut before = std::mem::replace(&mut self.now, larger);
            self.is_moved = true;
            match former {
                Some(former) if !is_anew => {
                    before.table = former;
                    self.before.push(Before::new(before));
                }
                _ => self.before.clear(),
            }
        }
        let before = self.before.iter_mut().map(|before| &mut before.memory);
        for copied in std::iter::once(&mut self.now).chain(before) {
            bytes += copied.write(changer, device, queue, encoder)?;
        }
        Ok(bytes)
    }

    pub(super) fn is_moved(&self) -> bool {
        self.is_moved
    }

    pub(super) fn submitted(&mut self) {
        self.is_moved = false;
    }

    pub(super) fn count_update(&mut self) {
        Before::count(&mut self.before);
    }

    pub(super) fn table(&self) -> &HashedTable {
        &self.now.table
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.now.memory {
            Memory::Buffer { buffer, .. } => buffer.buffer.as_entire_binding(),
            Memory::Texture(texture) => wgpu::BindingResource::TextureView(texture.view()),
        }
    }

    pub(super) fn buffer(&self) -> Option<&wgpu::Buffer> {
        match &self.now.memory {
            Memory::Buffer { buffer, .. } => Some(&buffer.buffer),
            Memory::Texture(_) => None,
        }
    }

    pub(super) fn texture(&self) -> Option<&wgpu::Texture> {
        match &self.now.memory {
            Memory::Buffer { .. } => None,
            Memory::Texture(texture) => Some(texture.texture()),
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.now.bytes() + self.before.iter().map(|before| before.memory.bytes()).sum::<u64>()
    }
}

impl Copied {
    /// Memory of its own for a table, which is sent for all commands submitted after this call; nothing reads
    /// it yet.
    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mut table: HashedTable,
        is_in_texture: bool,
    ) -> Result<Copied, GpuError> {
        table.take_written(); // all of it goes
        let words: Vec<u32> = table.buckets().iter().flat_map(|bucket| bucket.words()).collect();
        let memory = match is_in_texture {
            true => {
                let mut texture = WordTexture::new(device, words.len() as u32)?;
                texture.write_all(queue, &words);
                Memory::Texture(texture)
            }
            false => {
                let buffer = TableBuffer::new(device, words.len() as u64)?;
                queue.write_buffer(&buffer.buffer, 0, bytemuck::cast_slice(&words));
                Memory::Buffer { buffer, room: Room::default() }
            }
        };
        Ok(Copied { table, memory })
    }

    /// Sends the buckets that are others than what was sent.
    fn write(
        &mut self,
        changer: &PoolTableChanger,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<u64, GpuError> {
        let written = self.table.take_written().unwrap_or_default();
        if written.is_empty() {
            return Ok(0);
        }
        let words = |at: u32| self.table.buckets()[at as usize].words();
        match &mut self.memory {
            Memory::Texture(texture) => {
                for &at in &written {
                    for (first, word) in (at * HashedBucket::WORDS as u32..).zip(words(at)) {
                        texture.change(first, 1, |_| word);
                    }
                }
                texture.send(device, encoder, &[])
            }
            Memory::Buffer { buffer, room } => {
                let Some(pipelines) = &changer.pipelines else { return Ok(0) };
                let mut batch = vec![written.len() as u32, 0, 0, 0];
                for &at in &written {
                    batch.push(at);
                    batch.extend(words(at));
                }
                let sent = room.send(device, queue, &batch)?;
                let steps = [(&pipelines.write, chunks(written.len()))];
                room.carry_out(pipelines, device, encoder, buffer, &steps);
                Ok(sent)
            }
        }
    }

    fn bytes(&self) -> u64 {
        match &self.memory {
            Memory::Buffer { buffer, .. } => buffer.buffer.size(),
            Memory::Texture(texture) => texture.bytes(),
        }
    }
}
