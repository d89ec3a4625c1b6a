//! A page table in a texture, for devices whose shaders have no storage buffers.
//!
//! Its words lie in the texture as in a buffer, row after row (table_texture.wgsl). The CPU has them too, and sends the rows in which some
//! have changed.

use vastex_core::{Geometry, HashedPlace, PagePos, TableChange, TableLayout};

use crate::error::GpuError;
use crate::table::{Entries, Kind, TableBuffers};
use crate::table_changer::Applied;

/// Words of a row at least, so that small tables are not sent in many pieces.
const LEAST_WIDTH: u64 = 64;

/// See the head of the file.
#[derive(Debug)]
pub(crate) struct TableTexture {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    size: [u32; 2],
    /// Of each row, whether it is to be sent.
    is_changed: Vec<bool>,
}

impl TableTexture {
    /// A texture for so many bytes, of which all are to be sent.
    pub(crate) fn new(device: &wgpu::Device, bytes: u64) -> TableTexture {
        let size = texture_size(bytes / 4);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("vastex page table"),
            size: extent(size),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        TableTexture { texture, view, size, is_changed: vec![true; size[1] as usize] }
    }

    /// Bytes of the largest table that a device can have in a texture.
    pub(crate) fn most_bytes(device: &wgpu::Device) -> u64 {
        let side = u64::from(device.limits().max_texture_dimension_2d);
        // A row is a power of two wide.
        4 * side * (1 << side.ilog2())
    }

    /// Whether it is as large as it should be for so many bytes.
    pub(crate) fn fits(&self, bytes: u64) -> bool {
        self.size == texture_size(bytes / 4)
    }

    /// Words from `first` on are to be sent.
    pub(crate) fn mark(&mut self, first: u64, count: u64) {
        let [low, high] =
            [first, first + count.max(1) - 1].map(|word| (word / u64::from(self.size[0])) as usize);
        self.is_changed[low..=high].fill(true);
    }

    /// Sends the rows that are marked, for all commands submitted after this call; there are `count` words. Returns the bytes sent.
    pub(crate) fn send(&mut self, queue: &wgpu::Queue, count: u64, word: impl Fn(u64) -> u32) -> u64 {
        let (mut sent, mut row) = (0, 0);
        for run in self.is_changed.chunk_by(|a, b| a == b) {
            let rows = row..row + run.len() as u32;
            row = rows.end;
            if run[0] {
                sent += self.send_rows(queue, count, &word, rows);
            }
        }
        self.is_changed.fill(false);
        sent
    }

    fn send_rows(
        &self,
        queue: &wgpu::Queue,
        count: u64,
        word: impl Fn(u64) -> u32,
        rows: std::ops::Range<u32>,
    ) -> u64 {
        let [begin, end] = [rows.start, rows.end].map(|row| u64::from(row) * u64::from(self.size[0]));
        // Beyond the last word nobody looks.
        let words: Vec<u32> = (begin..end).map(|index| if index < count { word(index) } else { 0 }).collect();
        let bytes: &[u8] = bytemuck::cast_slice(&words);
        let origin = wgpu::Origin3d { x: 0, y: rows.start, z: 0 };
        let bytes_per_row = Some(self.size[0] * 4);
        queue.write_texture(
            wgpu::TexelCopyTextureInfo { origin, ..self.texture.as_image_copy() },
            bytes,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None },
            extent([self.size[0], rows.end - rows.start]),
        );
        bytes.len() as u64
    }

    pub(crate) fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    pub(crate) fn bytes(&self) -> u64 {
        4 * u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

impl TableBuffers {
    /// Carries out changes, in their order, to a table in a texture.
    pub(crate) fn apply_in_texture(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        changes: &[TableChange],
    ) -> Result<Applied, GpuError> {
        let Entries::Texture(texture) = &mut self.entries else { return Ok(Applied::default()) };
        match &mut self.kind {
            Kind::Direct { finest, image } => {
                for change in changes {
                    let changed = image.as_mut().map_or(0, |image| image.apply(&self.geometry, change));
                    if changed > 0 {
                        mark_below(texture, &self.geometry, *finest, change);
                    }
                }
            }
            Kind::Hashed(hashed) => {
                hashed.apply(changes);
                let Some(written) = hashed.take_written() else {
                    return Ok(Applied { bytes: self.lie_anew(device, queue), has_moved: true });
                };
                let words = HashedPlace::WORDS as u64;
                written.iter().for_each(|&place| texture.mark(u64::from(place) * words, words));
            }
        }
        Ok(Applied { bytes: self.send_marked(queue), has_moved: false })
    }
}

/// Marks what a change of a direct table may have changed: the entries at and below its page, of the levels from `finest` on.
fn mark_below(texture: &mut TableTexture, geometry: &Geometry, finest: u8, change: &TableChange) {
    let (layout, pos) = (TableLayout::new(geometry), change.page.pos(geometry.dims()));
    let begin = layout.first_entry(finest);
    for level in finest..=pos.level {
        let (low, high) = geometry.descendants(pos, level);
        for (z, y) in (low[2]..high[2]).flat_map(|z| (low[1]..high[1]).map(move |y| (z, y))) {
            let first = layout.entry_of(PagePos { level, x: low[0], y, z }) - begin;
            texture.mark(first, u64::from(high[0] - low[0]));
        }
    }
}

/// About as wide as high, so that what is sent of a row is little; a power of two wide.
fn texture_size(words: u64) -> [u32; 2] {
    let width = words.isqrt().max(1);
    let width = (1u64 << width.ilog2()).max(LEAST_WIDTH);
    [width as u32, u32::try_from(words.div_ceil(width)).unwrap_or(u32::MAX).max(1)]
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}
