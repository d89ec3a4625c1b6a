//! The array of all textures' and groups' records, by number: what shaders read of a texture before they look
//! up anything.
//!
//! Records have a fixed stride, in words of 16 bytes. They lie in a texture with a row for each number
//! (wgsl/param.wgsl): every device has textures, a word of 16 bytes is one read, and software drivers read it
//! several times as fast as from a storage buffer. There is room for 16 at first, and for twice as many where
//! a number is beyond that. In each frame [`ParamStore::write`] comes after `PoolTables::apply` of all pools,
//! and [`ParamStore::submitted`] after the submission.

use std::collections::BTreeSet;

use vastex_core::TextureNumber;

use crate::device::{alive, guarded, staged, words_texture};
use crate::error::GpuError;
use crate::tables::Before;

/// Records for which there is room at first.
const FIRST_RECORDS: u32 = 16;
/// Bytes of a word.
const WORD: u64 = 16;
/// Bytes that rows of what is sent are multiples of: those of a copy of several rows, and, where DirectX 12
/// copies no others directly, the places where copies begin.
const ROW: u64 = 512;

/// The records of all textures and groups of a device, by number, in GPU memory.
#[derive(Debug)]
pub struct ParamStore {
    /// Words of a record.
    stride: u32,
    words: Vec<[u32; 4]>,
    memory: Memory,
    /// What the records lay in before they moved to larger memory.
    before: Vec<Before<Former>>,
    /// Numbers of the records that are others than what was submitted.
    changed: BTreeSet<u16>,
    /// The memory is another than what was last submitted.
    is_moved: bool,
    /// Numbers of records that are to part from those that recorded commands see.
    parted: BTreeSet<u16>,
    /// Numbers of records that were set to zeros since the last submission.
    gone: BTreeSet<u16>,
}

/// What the records lay in before.
#[derive(Debug)]
struct Former {
    memory: Memory,
    /// Numbers of the records that stay here as they were, until they are zeros.
    frozen: BTreeSet<u16>,
}

#[derive(Debug)]
struct Memory {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

/// What a [`ParamStore::write`] has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ParamsWritten {
    /// Bytes sent to the GPU.
    pub bytes: u64,
    /// True if [`ParamStore::binding`] is another: bind groups of all textures are to be made anew after the
    /// submission.
    pub moved: bool,
}

impl ParamStore {
    /// Records of `stride` words, all of them zeros at first. Costs 256 bytes of GPU memory for each word of
    /// the stride.
    pub fn new(device: &wgpu::Device, stride: u32) -> Result<ParamStore, GpuError> {
        let memory = Memory::new(device, stride, FIRST_RECORDS)?;
        let words = vec![[0; 4]; (FIRST_RECORDS * stride) as usize];
        let [changed, parted, gone] = [const { BTreeSet::new() }; 3];
        let before = Vec::new();
        Ok(ParamStore { stride, words, memory, before, changed, is_moved: false, parted, gone })
    }

    /// Sets the record of a number, of at most a stride's words; zeros follow. The GPU hears of it with the
    /// next [`ParamStore::write`], if it is another than the one that is there.
    pub fn set(&mut self, number: TextureNumber, record: &[[u32; 4]]) {
        let stride = self.stride as usize;
        let first = usize::from(number.number()) * stride;
        if self.words.len() < first + stride {
            let records = (u32::from(number.number()) + 1).next_power_of_two();
            self.words.resize((records * self.stride) as usize, [0; 4]);
        }
        let (there, record) = (&mut self.words[first..first + stride], &record[..record.len().min(stride)]);
        let (head, rest) = there.split_at_mut(record.len());
        if head != record || rest.iter().any(|word| *word != [0; 4]) {
            head.copy_from_slice(record);
            rest.fill([0; 4]);
            self.changed.insert(number.number());
            if record.iter().all(|word| *word == [0; 4]) {
                self.gone.insert(number.number());
            }
        }
    }

    /// The record of a number: zeros where none was set.
    pub fn record(&self, number: TextureNumber) -> &[[u32; 4]] {
        let first = usize::from(number.number()) * self.stride as usize;
        self.words.get(first..first + self.stride as usize).unwrap_or_default()
    }

    /// Moves the records to new memory from the next [`ParamStore::write`] on, so that the records of these
    /// numbers stay as they are for commands that were recorded before: their tiles and tables move, too, and
    /// those commands keep the old ones bound.
    pub fn part(&mut self, numbers: impl IntoIterator<Item = TextureNumber>) {
        self.parted.extend(numbers.into_iter().map(TextureNumber::number));
    }

    /// Records copies of what has been set since the last submission: all in one upload. Commands recorded
    /// later in the encoder see it, and so do those that were recorded earlier and are submitted later, for
    /// [`RECORDED_AHEAD`](crate::RECORDED_AHEAD) updates also with bind groups that were made before the
    /// records moved.
    ///
    /// To be called once per submission, after the tables of all pools, and [`ParamStore::submitted`] after
    /// that: what was not submitted is written again.
    pub fn write(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<ParamsWritten, GpuError> {
        let records = self.words.len() as u32 / self.stride.max(1);
        let is_parted = !self.parted.is_empty() && !self.is_moved;
        if is_parted || self.memory.records() < records {
            let larger = Memory::new(device, self.stride, records)?;
            let memory = std::mem::replace(&mut self.memory, larger);
            self.before.push(Before::new(Former { memory, frozen: BTreeSet::new() }));
            self.is_moved = true;
        }
        for before in &mut self.before {
            before.memory.frozen.extend(&self.parted);
        }
        self.parted.clear();
        if self.is_moved {
            // The larger memory holds nothing before this is submitted.
            self.changed.extend((0..records as u16).filter(|&number| {
                let first = usize::from(number) * self.stride as usize;
                self.words[first..first + self.stride as usize].iter().any(|word| *word != [0; 4])
            }));
        }
        if self.changed.is_empty() {
            return Ok(ParamsWritten { bytes: 0, moved: self.is_moved });
        }
        let (stride, row) = (self.stride as usize, sent_words(self.stride));
        // Behind them a record of zeros, for who is gone.
        let zeros = self.changed.len();
        let mut words = vec![[0; 4]; row * (zeros + 1)];
        for (row, &number) in words.chunks_exact_mut(row).zip(&self.changed) {
            row[..stride].copy_from_slice(&self.words[usize::from(number) * stride..][..stride]);
        }
        let zeros = zeros as u64;
        alive(device)?;
        let buffer = staged(device, "vastex parameters", bytemuck::cast_slice(&words));
        let buffer = buffer.ok_or(GpuError::DeviceLost)?;
        let changed = self.changed.iter().copied().enumerate().map(|(at, number)| (at as u64, number));
        self.memory.copy(encoder, &buffer, self.stride, changed.clone());
        for Former { memory, frozen } in self.before.iter().map(|before| &before.memory) {
            let others = changed.clone().filter(|(_, number)| !frozen.contains(number));
            memory.copy(encoder, &buffer, self.stride, others);
            let gone = frozen.intersection(&self.gone).map(|&number| (zeros, number));
            memory.copy(encoder, &buffer, self.stride, gone);
        }
        Ok(ParamsWritten { bytes: WORD * words.len() as u64, moved: self.is_moved })
    }

    /// The commands of the last [`ParamStore::write`] were submitted between two updates, which none of those
    /// counts that may lie between the recording of commands and their submission.
    pub fn submitted_between(&mut self) {
        self.is_moved = false;
        self.changed.clear();
        self.gone.clear();
    }

    /// The commands of the last [`ParamStore::write`] were submitted, by an update.
    pub fn submitted(&mut self) {
        self.submitted_between();
        Before::count(&mut self.before);
    }

    /// What shaders bind. Another after a [`ParamStore::write`] that says so.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::TextureView(&self.memory.view)
    }

    /// The texture of [`ParamStore::binding`], rgba32uint. Can be copied from.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.memory.texture
    }

    /// GPU memory, with what the records lay in before while that is followed.
    pub fn bytes(&self) -> u64 {
        let before = self.before.iter().map(|before| &before.memory.memory);
        std::iter::once(&self.memory).chain(before).map(|memory| memory.bytes(self.stride)).sum()
    }
}

impl Memory {
    fn new(device: &wgpu::Device, stride: u32, records: u32) -> Result<Memory, GpuError> {
        alive(device)?;
        let bytes = WORD * u64::from(stride) * u64::from(records);
        guarded(device, bytes, || {
            let format = wgpu::TextureFormat::Rgba32Uint;
            let texture = words_texture(device, "vastex parameters", [stride, records], format);
            let view = texture.create_view(&Default::default());
            Memory { texture, view }
        })
    }

    fn records(&self) -> u32 {
        self.texture.height()
    }

    fn bytes(&self, stride: u32) -> u64 {
        WORD * u64::from(stride) * u64::from(self.records())
    }

    /// Copies records, each of which lies at a place in `from`, but for those beyond the end.
    fn copy(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        from: &wgpu::Buffer,
        stride: u32,
        numbers: impl Iterator<Item = (u64, u16)>,
    ) {
        let (row, room) = (WORD * sent_words(stride) as u64, self.records());
        let places: Vec<(u64, u32)> = numbers
            .map(|(at, number)| (at, u32::from(number)))
            .filter(|(_, number)| *number < room)
            .collect();
        for run in places.chunk_by(|a, b| (a.0 + 1, a.1 + 1) == *b) {
            let (at, y) = run[0];
            let layout = wgpu::TexelCopyBufferLayout {
                offset: row * at,
                bytes_per_row: Some(row as u32),
                rows_per_image: None,
            };
            encoder.copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo { buffer: from, layout },
                wgpu::TexelCopyTextureInfo {
                    origin: wgpu::Origin3d { x: 0, y, z: 0 },
                    ..self.texture.as_image_copy()
                },
                wgpu::Extent3d { width: stride, height: run.len() as u32, depth_or_array_layers: 1 },
            );
        }
    }
}

/// Words of a record where it is sent.
fn sent_words(stride: u32) -> usize {
    ((WORD * u64::from(stride)).next_multiple_of(ROW) / WORD) as usize
}
