//! The belt: memory that the GPU copies tiles from, in rooms of a tile each, which other threads fill while
//! they are mapped.
//!
//! | a room is | entered by | left by |
//! |---|---|---|
//! | free, mapped | being made; the GPU being done with it | [`Belt::put`] |
//! | filled, mapped | [`Belt::put`] | the first [`Pool::upload_from`](crate::Pool::upload_from); being dropped, which makes it free |
//! | filled, of the GPU | [`Pool::upload_from`](crate::Pool::upload_from) | being dropped, which asks to have it mapped again |
//! | with the GPU | being dropped | the end of the commands that copy from it: free again |
//!
//! So once there are as many rooms as are filled at once nothing is allocated any more, and no room is waited
//! for. What `wgpu::Queue::write_texture` does in the place of this is a buffer made, filled and destroyed
//! for each layer of each tile.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use vastex_core::{Layer, LayerFormat};

use crate::device::guarded;
use crate::layer::{BlockRows, block_rows, layer_texels};
use crate::ranges::{ANY, ordered, range_of};

/// What a layer's part of a room begins at a multiple of, as Direct3D 12 wants it.
const PART_ALIGN: u64 = 512;

/// How a tile lies in a room: its layers one after the other, each row by row, rows at multiples of 256
/// bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BeltLayout {
    parts: Vec<Part>,
    tile_bytes: u64,
    bytes: u64,
    /// What the values of a volume's tile are, if any is smaller than another.
    ordered: Option<LayerFormat>,
}

/// A layer's part of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// In the tile's bytes, and in the room's.
    from: usize,
    pub(crate) to: u64,
    pub(crate) rows: BlockRows,
    pub(crate) padded_row_bytes: u32,
}

impl BeltLayout {
    /// For tiles of so many texels per side with these layers; `None` if a layer is no whole number of blocks
    /// of it.
    pub fn new(tile: [u32; 3], layers: &[Layer]) -> Option<BeltLayout> {
        let (mut parts, mut from, mut to) = (Vec::new(), 0, 0u64);
        for layer in layers {
            let rows = block_rows(layer.format, layer_texels(layer, tile)?);
            let padded_row_bytes = rows.row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
            parts.push(Part { from, to, rows, padded_row_bytes });
            from += rows.rows as usize * rows.row_bytes as usize;
            to += u64::from(rows.rows) * u64::from(padded_row_bytes);
            to = to.next_multiple_of(PART_ALIGN);
        }
        let ordered = if tile[2] > 1 { ordered(layers) } else { None };
        Some(BeltLayout { parts, tile_bytes: from as u64, bytes: to, ordered })
    }

    /// Bytes of a room: those of a tile, up to 1.9 times as many for 136 texels of one byte, and up to 3.9
    /// times for 66, as bricks of volumes have.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes of a tile.
    pub fn tile_bytes(&self) -> u64 {
        self.tile_bytes
    }

    pub(crate) fn parts(&self) -> &[Part] {
        &self.parts
    }
}

/// Rooms of a device, of any layouts, up to a limit of bytes.
#[derive(Clone, Debug)]
pub struct Belt(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    device: wgpu::Device,
    limit: u64,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// Of all rooms.
    bytes: u64,
    /// Buffers that are mapped and not filled, by their bytes.
    free: HashMap<u64, Vec<wgpu::Buffer>>,
    /// Buffers that the GPU is not done with, by a number.
    returning: HashMap<u64, wgpu::Buffer>,
    numbers: u64,
    counts: BeltCounts,
}

/// What a belt has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BeltCounts {
    /// Tiles put into a room.
    pub put: u64,
    /// Tiles for which there was no room.
    pub refused: u64,
    /// Rooms made.
    pub made: u64,
}

impl Belt {
    /// A belt without rooms yet; they will take `limit` bytes at most.
    pub fn new(device: &wgpu::Device, limit: u64) -> Belt {
        Belt(Arc::new(Shared { device: device.clone(), limit, state: Mutex::default() }))
    }

    /// Returns true if a belt is better than `wgpu::Queue::write_texture` on this device: where buffers can
    /// be mapped by any thread, and stay where they are. That is so with Vulkan, Metal and Direct3D 12; not
    /// with OpenGL, where a buffer is mapped by one thread, and not in a browser, where what is mapped is a
    /// copy.
    pub fn suits(device: &wgpu::Device) -> bool {
        use wgpu::Backend::{Dx12, Metal, Vulkan};
        matches!(device.adapter_info().backend, Vulkan | Metal | Dx12)
    }

    /// Puts a tile into a room, on whatever thread. Gives `None` if all rooms that the limit allows are
    /// filled, or if the device is lost or has no memory for one. Never waits. Costs a copy of the tile,
    /// and of a volume's tile a look at each of its values ([`BeltTile::range`]).
    pub fn put(&self, layout: &Arc<BeltLayout>, tile: &[u8]) -> Option<BeltTile> {
        if tile.len() as u64 != layout.tile_bytes {
            return None;
        }
        let room = self.take(layout.bytes).or_else(|| self.make(layout.bytes));
        let filled = room.and_then(|room| fill(&room, layout, tile).map(|()| room));
        let mut state = self.0.lock();
        match filled {
            None => {
                state.counts.refused += 1;
                None
            }
            Some(buffer) => {
                state.counts.put += 1;
                drop(state);
                let (belt, layout, is_mapped) = (self.clone(), layout.clone(), AtomicBool::new(true));
                let range = layout.ordered.map_or(ANY, |format| range_of(format, tile));
                Some(BeltTile { buffer, belt, layout, range, is_mapped })
            }
        }
    }

    /// A room that is free.
    fn take(&self, bytes: u64) -> Option<wgpu::Buffer> {
        self.0.lock().free.get_mut(&bytes)?.pop()
    }

    /// One more room, where the limit allows it; rooms of other layouts that are free give way.
    fn make(&self, bytes: u64) -> Option<wgpu::Buffer> {
        let mut gone = Vec::new();
        {
            let mut state = self.0.lock();
            while state.bytes + bytes > self.0.limit {
                let (&of, _) = state.free.iter().find(|(of, free)| **of != bytes && !free.is_empty())?;
                gone.extend(state.free.get_mut(&of).and_then(Vec::pop));
                state.bytes -= of;
            }
            state.bytes += bytes;
        }
        drop(gone);
        let descriptor = wgpu::BufferDescriptor {
            label: Some("vastex belt"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: true,
        };
        let made = guarded(&self.0.device, bytes, || self.0.device.create_buffer(&descriptor)).ok();
        // On a lost device it cannot be written to.
        let made = made.filter(|room| room.get_mapped_range_mut(..).is_ok());
        let mut state = self.0.lock();
        match &made {
            Some(_) => state.counts.made += 1,
            None => state.bytes -= bytes,
        }
        made
    }

    /// Bytes of all rooms.
    pub fn bytes(&self) -> u64 {
        self.0.lock().bytes
    }

    /// What the belt has done so far.
    pub fn counts(&self) -> BeltCounts {
        self.0.lock().counts
    }

    /// Returns true if `other` is this belt.
    pub fn is(&self, other: &Belt) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The GPU is done with a room; or it will never be, since the device is lost.
    fn came_back(&self, number: u64, is_mapped: bool) {
        let mut state = self.lock();
        let Some(room) = state.returning.remove(&number) else { return };
        if is_mapped {
            state.free.entry(room.size()).or_default().push(room);
        } else {
            state.bytes -= room.size();
            drop(state);
            drop(room);
        }
    }
}

/// Copies a tile into a room that is mapped.
fn fill(room: &wgpu::Buffer, layout: &BeltLayout, tile: &[u8]) -> Option<()> {
    let mut mapped = room.get_mapped_range_mut(..).ok()?;
    for part in &layout.parts {
        let (row_bytes, padded) = (part.rows.row_bytes as usize, part.padded_row_bytes as usize);
        let part_bytes = part.rows.rows as usize * row_bytes;
        let rows = tile[part.from..][..part_bytes].chunks_exact(row_bytes);
        let first = part.to as usize;
        if row_bytes == padded {
            mapped.slice(first..first + part_bytes).copy_from_slice(&tile[part.from..][..part_bytes]);
            continue;
        }
        for (row, to) in rows.zip((first..).step_by(padded)) {
            mapped.slice(to..to + row_bytes).copy_from_slice(row);
        }
    }
    Some(())
}

/// A tile in a room. When it is dropped the room is free again, as soon as commands that were submitted with
/// it are done; it is dropped when they are submitted, or will never be.
#[derive(Debug)]
pub struct BeltTile {
    buffer: wgpu::Buffer,
    belt: Belt,
    layout: Arc<BeltLayout>,
    range: [f32; 2],
    is_mapped: AtomicBool,
}

impl BeltTile {
    /// The belt that it lies on.
    pub fn belt(&self) -> &Belt {
        &self.belt
    }

    /// How the tile lies on the belt.
    pub fn layout(&self) -> &BeltLayout {
        &self.layout
    }

    /// The least and the greatest of its values as shaders sample them, if it is of a volume and they have an
    /// order; else the least and the greatest float.
    pub fn range(&self) -> [f32; 2] {
        self.range
    }

    /// For commands that copy from it.
    pub(crate) fn buffer(&self) -> &wgpu::Buffer {
        if self.is_mapped.swap(false, Ordering::AcqRel) {
            self.buffer.unmap();
        }
        &self.buffer
    }
}

impl Drop for BeltTile {
    fn drop(&mut self) {
        let (shared, room) = (&self.belt.0, self.buffer.clone());
        let mut state = shared.lock();
        if *self.is_mapped.get_mut() {
            state.free.entry(room.size()).or_default().push(room);
            return;
        }
        let number = state.numbers;
        state.numbers += 1;
        state.returning.insert(number, room.clone());
        drop(state);
        // What the device calls back must not keep the belt: it goes with the textures that it is for.
        let weak = Arc::downgrade(shared);
        room.map_async(wgpu::MapMode::Write, .., move |result| {
            if let Some(shared) = weak.upgrade() {
                shared.came_back(number, result.is_ok());
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_begin_at_multiples_of_256_bytes_and_layers_at_those_of_512() {
        let layers = [
            Layer::new("color", LayerFormat::Rgba8),
            Layer { scale: 2, ..Layer::new("mask", LayerFormat::Bc4) },
            Layer::new("value", LayerFormat::R8),
        ];
        let layout = BeltLayout::new([136, 136, 1], &layers).unwrap();
        let of_part = |p: &Part| (p.from, p.to, p.rows.rows, p.rows.row_bytes, p.padded_row_bytes);
        let parts: Vec<_> = layout.parts.iter().map(of_part).collect();
        let color = 136 * 544;
        // 17x17 blocks of 8 bytes.
        let mask = 17 * 136;
        assert_eq!(
            parts,
            [
                (0, 0, 136, 544, 768),
                (color, 136 * 768, 17, 136, 256),
                (color + mask, 136 * 768 + 17 * 256 + 256, 136, 136, 256),
            ]
        );
        assert_eq!(layout.tile_bytes as usize, color + mask + 136 * 136);
        assert_eq!(layout.bytes(), 136 * 768 + 18 * 256 + 136 * 256);
        // The most that one layer takes besides.
        let value = BeltLayout::new([136, 136, 1], &layers[2..]).unwrap();
        assert!(value.bytes as f64 / value.tile_bytes as f64 <= 1.9);
        assert_eq!(BeltLayout::new([134, 134, 1], &layers), None);
    }

    #[test]
    fn a_brick_lies_image_after_image() {
        let layers = [Layer::new("density", LayerFormat::R8), Layer::new("label", LayerFormat::Rgba16)];
        let layout = BeltLayout::new([66; 3], &layers).unwrap();
        let [density, label] = layout.parts[..] else { panic!("two layers have two parts") };
        assert_eq!(
            (density.rows.rows, density.rows.rows_per_image, density.rows.row_bytes),
            (66 * 66, 66, 66)
        );
        assert_eq!((label.from, label.padded_row_bytes), (66 * 66 * 66, 768));
        assert_eq!(layout.tile_bytes as usize, 66 * 66 * 66 * 9);
        // No device holds blocks in a 3-D texture without being asked.
        assert_eq!(BeltLayout::new([64; 3], &[Layer::new("density", LayerFormat::Bc4)]), None);
    }
}
