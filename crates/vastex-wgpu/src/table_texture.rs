//! A page table in a texture, for devices whose shaders have no storage buffers.
//!
//! Its words lie in the texture as in a buffer, row after row (table_texture.wgsl). The CPU has them too, and sends the rows in which some
//! have changed.

use vastex_core::{Geometry, HashedBucket, PageNumbering, PagePos, TableChange};

use crate::device::{alive, staged};
use crate::error::GpuError;
use crate::table::{Entries, Kind, TableBuffers, Words};
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
    /// Rows at the beginning that nothing reads yet, and that are sent by and by.
    unsent: u32,
}

impl TableTexture {
    /// A texture for so many bytes, of which nothing has been sent.
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
        TableTexture { texture, view, size, is_changed: vec![false; size[1] as usize], unsent: size[1] }
    }

    /// Bytes of the largest table that a device can have in a texture.
    pub(crate) fn most_bytes(device: &wgpu::Device) -> u64 {
        let side = u64::from(device.limits().max_texture_dimension_2d);
        // A row is a power of two wide.
        4 * side * (1 << side.ilog2())
    }

    /// Words from `first` on are to be sent.
    pub(crate) fn mark(&mut self, first: u64, count: u64) {
        let [low, high] =
            [first, first + count.max(1) - 1].map(|word| (word / u64::from(self.size[0])) as usize);
        self.is_changed[low..=high].fill(true);
    }

    /// Records copies of the rows that are marked, but for those that are unsent, and returns their bytes.
    pub(crate) fn send(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        words: &Words<'_>,
    ) -> u64 {
        let (mut sent, mut row) = (0, self.unsent);
        for run in self.is_changed[self.unsent as usize..].chunk_by(|a, b| a == b) {
            let rows = row..row + run.len() as u32;
            row = rows.end;
            if run[0] {
                sent += self.send_rows(device, encoder, words, &rows);
            }
        }
        self.is_changed.fill(false);
        sent
    }

    /// Records a copy of the last unsent rows, as many as `budget` bytes are, one at least where it is not 0; takes them from it and returns
    /// their bytes.
    pub(crate) fn send_more(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        words: &Words<'_>,
        budget: &mut u64,
    ) -> u64 {
        let row_bytes = 4 * u64::from(self.size[0]);
        let rows = budget.div_ceil(row_bytes).min(u64::from(self.unsent)) as u32;
        if rows == 0 {
            return 0;
        }
        let rows = self.unsent - rows..self.unsent;
        self.unsent = rows.start;
        let sent = self.send_rows(device, encoder, words, &rows);
        *budget = budget.saturating_sub(sent);
        sent
    }

    /// The first word that has been sent.
    pub(crate) fn first_sent(&self) -> u64 {
        u64::from(self.unsent) * u64::from(self.size[0])
    }

    fn send_rows(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        words: &Words<'_>,
        rows: &std::ops::Range<u32>,
    ) -> u64 {
        let bytes = self.rows(words, rows);
        // A lost device shows where the frame begins.
        if let Some(buffer) = staged(device, "vastex page table", bytemuck::cast_slice(&bytes)) {
            let source = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout: self.layout() };
            encoder.copy_buffer_to_texture(source, self.at(rows.start), self.extent_of(rows));
        }
        bytes.len() as u64 * 4
    }

    /// Writes all rows, for all commands submitted after this call, and returns their bytes. For a texture that nothing reads yet.
    pub(crate) fn write_all(&mut self, queue: &wgpu::Queue, words: &Words<'_>) -> u64 {
        let rows = 0..self.size[1];
        let bytes = self.rows(words, &rows);
        let bytes: &[u8] = bytemuck::cast_slice(&bytes);
        queue.write_texture(self.at(0), bytes, self.layout(), self.extent_of(&rows));
        self.is_changed.fill(false);
        self.unsent = 0;
        bytes.len() as u64
    }

    fn rows(&self, words: &Words<'_>, rows: &std::ops::Range<u32>) -> Vec<u32> {
        let [begin, end] = [rows.start, rows.end].map(|row| u64::from(row) * u64::from(self.size[0]));
        words.range(begin..end)
    }

    fn at(&self, row: u32) -> wgpu::TexelCopyTextureInfo<'_> {
        wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: 0, y: row, z: 0 },
            ..self.texture.as_image_copy()
        }
    }

    /// Rows are at least [`LEAST_WIDTH`] words, and a power of two, as copies from buffers need them.
    fn layout(&self) -> wgpu::TexelCopyBufferLayout {
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(self.size[0] * 4), rows_per_image: None }
    }

    fn extent_of(&self, rows: &std::ops::Range<u32>) -> wgpu::Extent3d {
        extent([self.size[0], rows.end - rows.start])
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
        encoder: &mut wgpu::CommandEncoder,
        changes: &[TableChange],
    ) -> Result<Applied, GpuError> {
        alive(device)?;
        match &mut self.kind {
            Kind::Direct { image, .. } => {
                let is_other = |change: &&TableChange| {
                    image.as_mut().is_some_and(|image| image.apply(&self.geometry, change) > 0)
                };
                let changed: Vec<TableChange> = changes.iter().filter(is_other).copied().collect();
                self.mark(&changed);
                self.growth.mark(&self.geometry, &changed);
            }
            Kind::Hashed(hashed) => {
                hashed.apply(changes);
                if let Some(before) = hashed.take_before() {
                    let mut before = self.hash_elsewhere(device, queue, before)?;
                    before.mark_written();
                    let bytes = before.send_marked(device, encoder) + self.send_all(queue);
                    return Ok(Applied { bytes, before: Some(Box::new(before)) });
                }
                self.mark_written();
            }
        }
        Ok(Applied { bytes: self.send_marked(device, encoder), before: None })
    }

    /// See [`crate::TableChanger::follow`].
    pub(crate) fn follow_in_texture(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        now: &TableBuffers,
        changes: &[TableChange],
    ) -> u64 {
        match (&mut self.kind, &now.kind) {
            (Kind::Direct { begin, .. }, Kind::Direct { image: Some(image), .. }) => {
                let words = Words::of(image, &self.geometry, *begin);
                self.mark(changes);
                let Entries::Texture(texture) = &mut self.entries else { return 0 };
                texture.send(device, encoder, &words)
            }
            (Kind::Hashed(hashed), _) => {
                hashed.evict(changes);
                self.mark_written();
                self.send_marked(device, encoder)
            }
            _ => 0,
        }
    }

    /// Marks what these changes of a direct table may have changed.
    fn mark(&mut self, changes: &[TableChange]) {
        if let (Entries::Texture(texture), Kind::Direct { begin, .. }) = (&mut self.entries, &self.kind) {
            changes.iter().for_each(|change| mark_below(texture, &self.geometry, *begin, change));
        }
    }

    /// Marks the places of a hashed table that were written.
    fn mark_written(&mut self) {
        let (Entries::Texture(texture), Kind::Hashed(hashed)) = (&mut self.entries, &mut self.kind) else {
            return;
        };
        let words = HashedBucket::WORDS as u64;
        let written = hashed.take_written().unwrap_or_default();
        written.iter().for_each(|&place| texture.mark(u64::from(place) * words, words));
    }
}

/// Marks what a change of a direct table may have changed: the entries at and below its page, of the levels from `finest` on.
pub(crate) fn mark_below(texture: &mut TableTexture, geometry: &Geometry, finest: u8, change: &TableChange) {
    let (layout, pos) = (PageNumbering::new(geometry), change.page.pos(geometry.dims()));
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
