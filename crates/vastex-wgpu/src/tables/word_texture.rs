//! Page tables in a texture, for devices whose shaders have no storage buffers.
//!
//! Words lie there as in a buffer, row after row (wgsl/arena_texture.wgsl). The CPU has them too, and sends
//! the pieces in which some have changed, all of a frame in one upload.

use crate::device::{alive, guarded, staged, words_texture};
use crate::error::GpuError;

/// Words of a piece: what is sent where one of them has changed.
const PIECE: u32 = 64;
/// Words of a row at most; a power of two.
const WIDEST: u32 = 2048;

/// Words of 32 bits in a texture, row after row, for devices whose shaders have no storage buffers.
#[derive(Debug)]
pub(super) struct WordTexture {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    width: u32,
    rows: u32,
    words: Vec<u32>,
    /// Of each piece, whether it is to be sent.
    is_changed: Vec<bool>,
    /// Of each piece, whether nobody looks there yet, and it is not sent before it is
    /// [shown](WordTexture::show).
    is_hidden: Vec<bool>,
}

/// Part of a table that goes to where it stands in the texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Region {
    first: u32,
    count: u32,
}

impl WordTexture {
    /// A texture for so many words at least.
    pub(super) fn new(device: &wgpu::Device, words: u32) -> Result<WordTexture, GpuError> {
        alive(device)?;
        let width = WordTexture::row_words(device);
        let rows = words.div_ceil(width).max(1);
        let texture = guarded(device, u64::from(width) * u64::from(rows) * 4, || {
            words_texture(device, "vastex page tables", [width, rows], wgpu::TextureFormat::R32Uint)
        })?;
        let view = texture.create_view(&Default::default());
        let words = vec![0; (width * rows) as usize];
        let pieces = words.len() / PIECE as usize;
        let (is_changed, is_hidden) = (vec![false; pieces], vec![false; pieces]);
        Ok(WordTexture { texture, view, width, rows, words, is_changed, is_hidden })
    }

    /// Words of a row on a device: a power of two.
    pub(super) fn row_words(device: &wgpu::Device) -> u32 {
        1 << device.limits().max_texture_dimension_2d.clamp(PIECE, WIDEST).ilog2()
    }

    /// Words of the largest such texture.
    pub(super) fn most_words(device: &wgpu::Device) -> u64 {
        u64::from(WordTexture::row_words(device)) * u64::from(device.limits().max_texture_dimension_2d)
    }

    /// All words, as many as fill the rows.
    pub(super) fn len(&self) -> u32 {
        self.words.len() as u32
    }

    /// A larger texture with the same words, which a command copies; what is to be sent stays to be sent.
    pub(super) fn enlarged(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        words: u32,
    ) -> Result<WordTexture, GpuError> {
        let mut larger = WordTexture::new(device, words)?;
        let to = larger.texture.as_image_copy();
        encoder.copy_texture_to_texture(self.texture.as_image_copy(), to, extent(self.width, self.rows));
        larger.words[..self.words.len()].copy_from_slice(&self.words);
        larger.is_changed[..self.is_changed.len()].copy_from_slice(&self.is_changed);
        larger.is_hidden[..self.is_hidden.len()].copy_from_slice(&self.is_hidden);
        Ok(larger)
    }

    /// Writes all words from the beginning, for all commands submitted after this call. For a texture that
    /// nothing reads yet.
    pub(super) fn write_all(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        self.words[..words.len()].copy_from_slice(words);
        let bytes_per_row = Some(self.width * 4);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        let bytes: &[u8] = bytemuck::cast_slice(&self.words);
        queue.write_texture(self.texture.as_image_copy(), bytes, layout, extent(self.width, self.rows));
        self.is_changed.fill(false);
    }

    /// Some words become what `change` makes of each; returns whether one is another.
    pub(super) fn change(&mut self, first: u32, count: u32, change: impl Fn(u32) -> u32) -> bool {
        let mut is_other = false;
        for word in &mut self.words[first as usize..(first + count) as usize] {
            let other = change(*word);
            is_other |= other != *word;
            *word = other;
        }
        if is_other {
            self.mark(first, count);
        }
        is_other
    }

    /// Some words are to be sent.
    pub(super) fn mark(&mut self, first: u32, count: u32) {
        if count > 0 {
            self.is_changed[(first / PIECE) as usize..=((first + count - 1) / PIECE) as usize].fill(true);
        }
    }

    /// Some whole pieces are not to be sent before they are shown. Returns false where they are no whole
    /// pieces: those are sent at once.
    pub(super) fn hide(&mut self, first: u32, count: u32) -> bool {
        let is_whole = first.is_multiple_of(PIECE) && count.is_multiple_of(PIECE);
        if is_whole {
            self.is_hidden[(first / PIECE) as usize..((first + count) / PIECE) as usize].fill(true);
        }
        is_whole
    }

    /// Some words are sent as soon as they change, whatever was hidden where they lie.
    pub(super) fn unhide(&mut self, first: u32, count: u32) {
        if count > 0 {
            self.is_hidden[(first / PIECE) as usize..=((first + count - 1) / PIECE) as usize].fill(false);
        }
    }

    /// Sends of what is hidden as much as `budget` bytes are, which are taken from it, one piece at least
    /// where it is not 0. Returns true if nothing of these words is hidden any more.
    pub(super) fn show(&mut self, first: u32, count: u32, budget: &mut u64) -> bool {
        for piece in first / PIECE..(first + count).div_ceil(PIECE) {
            let piece = piece as usize;
            if self.is_hidden[piece] {
                if *budget == 0 {
                    return false;
                }
                *budget = budget.saturating_sub(u64::from(PIECE) * 4);
                self.is_hidden[piece] = false;
                self.is_changed[piece] = true;
            }
        }
        true
    }

    /// Everything is to be sent, and nothing is hidden.
    pub(super) fn mark_all(&mut self) {
        self.is_changed.fill(true);
        self.is_hidden.fill(false);
    }

    /// Records copies of what is to be sent, to this texture and to those in which it lay `before`, and
    /// returns the bytes.
    pub(super) fn send(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        before: &[&WordTexture],
    ) -> Result<u64, GpuError> {
        let regions = self.regions();
        self.is_changed
            .iter_mut()
            .zip(&self.is_hidden)
            .for_each(|(is_changed, hidden)| *is_changed &= *hidden);
        if regions.is_empty() {
            return Ok(0);
        }
        let words =
            |region: &Region| &self.words[region.first as usize..(region.first + region.count) as usize];
        let bytes: Vec<u32> = regions.iter().flat_map(words).copied().collect();
        alive(device)?;
        let buffer = staged(device, "vastex page tables", bytemuck::cast_slice(&bytes));
        let buffer = buffer.ok_or(GpuError::DeviceLost)?;
        for of in std::iter::once(&*self).chain(before.iter().copied()) {
            let mut offset = 0;
            for region in &regions {
                of.copy(encoder, &buffer, offset, *region);
                offset += 4 * u64::from(region.count);
            }
        }
        Ok(4 * bytes.len() as u64)
    }

    /// What is to be sent, each part within a row or of whole rows.
    fn regions(&self) -> Vec<Region> {
        let mut regions: Vec<Region> = Vec::new();
        let is_due = |piece: &usize| self.is_changed[*piece] && !self.is_hidden[*piece];
        for piece in (0..self.is_changed.len()).filter(is_due) {
            let first = piece as u32 * PIECE;
            let column = first % self.width;
            match regions.last_mut() {
                // Joins what is before it in the row.
                Some(last) if last.first + last.count == first && column != 0 => last.count += PIECE,
                _ => regions.push(Region { first, count: PIECE }),
            }
        }
        let is_row = |region: &Region| region.count == self.width;
        let mut joined: Vec<Region> = Vec::with_capacity(regions.len());
        for region in regions {
            match joined.last_mut() {
                Some(last)
                    if last.first + last.count == region.first
                        && is_row(&region)
                        && last.count.is_multiple_of(self.width) =>
                {
                    last.count += region.count;
                }
                _ => joined.push(region),
            }
        }
        joined
    }

    fn copy(&self, encoder: &mut wgpu::CommandEncoder, from: &wgpu::Buffer, offset: u64, region: Region) {
        let (x, y) = (region.first % self.width, region.first / self.width);
        let rows = (region.count / self.width).max(1).min(self.rows.saturating_sub(y));
        if rows == 0 {
            return; // beyond what lay before
        }
        let bytes_per_row = (rows > 1).then_some(self.width * 4);
        let layout = wgpu::TexelCopyBufferLayout { offset, bytes_per_row, rows_per_image: None };
        let source = wgpu::TexelCopyBufferInfo { buffer: from, layout };
        let origin = wgpu::Origin3d { x, y, z: 0 };
        let to = wgpu::TexelCopyTextureInfo { origin, ..self.texture.as_image_copy() };
        encoder.copy_buffer_to_texture(source, to, extent(region.count.min(self.width), rows));
    }

    pub(super) fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    pub(super) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    pub(super) fn bytes(&self) -> u64 {
        4 * u64::from(self.width) * u64::from(self.rows)
    }
}

fn extent(width: u32, height: u32) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}
