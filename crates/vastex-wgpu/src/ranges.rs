//! The least and the largest value in each slot of a pool of volumes: what a ray leaps over where nothing of
//! it would show.
//!
//! Values are those that shaders sample. They lie in a texture with a texel for each slot
//! (`wgsl/brick_pool`), and go to the GPU when the tile of the slot does; when the tile leaves, they stay
//! until another comes. What has more than one channel has no order, so nothing is said of it. Values of a
//! tile that goes by the belt are looked through by the thread that puts it there, else by the frame's.

use std::collections::BTreeSet;

use vastex_core::{Layer, LayerFormat, PoolLayout, Slot, SlotMove};

/// Slots in a row of the texture.
pub(crate) const RANGE_COLUMNS: u32 = 1024;
/// Says nothing.
pub(crate) const ANY: [f32; 2] = [-f32::MAX, f32::MAX];

/// What is known of the values in the slots of a pool. Eight bytes of GPU memory for each slot, at least 8
/// KiB.
#[derive(Debug)]
pub(crate) struct Ranges {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// The format of the values; `None` where nothing is said of any.
    format: Option<LayerFormat>,
    of_slots: Vec<[f32; 2]>,
    changed_rows: BTreeSet<u32>,
}

impl Ranges {
    /// For a pool in which nothing is known.
    pub(crate) fn new(device: &wgpu::Device, layout: &PoolLayout, layers: &[Layer]) -> Ranges {
        let rows = layout.slots().div_ceil(RANGE_COLUMNS).max(1);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("vastex ranges"),
            size: wgpu::Extent3d { width: RANGE_COLUMNS, height: rows, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rg32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let of_slots = vec![ANY; (rows * RANGE_COLUMNS) as usize];
        Ranges { texture, view, format: ordered(layers), of_slots, changed_rows: (0..rows).collect() }
    }

    /// The tile of a slot is another one. Costs a look at each of its values.
    pub(crate) fn set(&mut self, slot: Slot, tile: &[u8]) {
        let range = self.format.map_or(ANY, |format| range_of(format, tile));
        self.set_range(slot, range);
    }

    /// The same where the least and the largest value are known.
    pub(crate) fn set_range(&mut self, slot: Slot, range: [f32; 2]) {
        let Some(known) = self.of_slots.get_mut(slot.index() as usize) else { return };
        if std::mem::replace(known, range) != range {
            self.changed_rows.insert(slot.index() / RANGE_COLUMNS);
        }
    }

    /// Takes over what is known of tiles that come from another pool.
    pub(crate) fn follow(&mut self, other: &Ranges, moves: &[SlotMove]) {
        for SlotMove { from, to } in moves {
            if let Some(range) = other.of_slots.get(from.index() as usize) {
                self.set_range(*to, *range);
            }
        }
    }

    /// Tells the GPU what has changed, for all commands submitted after this call: 8 KiB for each row with a
    /// change.
    pub(crate) fn send(&mut self, queue: &wgpu::Queue) {
        while let Some(row) = self.changed_rows.pop_first() {
            let first = (row * RANGE_COLUMNS) as usize;
            let bytes = bytemuck::cast_slice(&self.of_slots[first..first + RANGE_COLUMNS as usize]);
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: 0, y: row, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                },
                bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(RANGE_COLUMNS * size_of::<[f32; 2]>() as u32),
                    rows_per_image: None,
                },
                wgpu::Extent3d { width: RANGE_COLUMNS, height: 1, depth_or_array_layers: 1 },
            );
        }
    }

    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }
}

/// The format of tiles whose values are smaller and larger than one another: of one layer with one channel.
pub(crate) fn ordered(layers: &[Layer]) -> Option<LayerFormat> {
    use LayerFormat::{R8, R16, R16Float, R32Float};
    let [layer] = layers else { return None };
    matches!(layer.format, R8 | R16 | R16Float | R32Float).then_some(layer.format)
}

/// The least and the largest value of a tile of a format that has an order.
pub(crate) fn range_of(format: LayerFormat, tile: &[u8]) -> [f32; 2] {
    match format {
        LayerFormat::R8 => {
            let (least, most) = tile.iter().fold((u8::MAX, 0), |(a, b), &v| (a.min(v), b.max(v)));
            [least, most].map(|value| f32::from(value) / f32::from(u8::MAX))
        }
        LayerFormat::R16 => {
            let values = tile.as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes));
            let (least, most) = values.fold((u16::MAX, 0), |(a, b), v| (a.min(v), b.max(v)));
            [least, most].map(|value| f32::from(value) / f32::from(u16::MAX))
        }
        LayerFormat::R16Float => {
            let values =
                tile.as_chunks::<2>().0.iter().map(|bytes| half::f16::from_le_bytes(*bytes).to_f32());
            range_of_floats(values)
        }
        LayerFormat::R32Float => {
            range_of_floats(tile.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)))
        }
        _ => ANY,
    }
    .map(|value| value.clamp(-f32::MAX, f32::MAX))
}

/// The least and the largest of floats. What is no number is in no comparison, and shows as 0; so may what is
/// blended with an infinity.
fn range_of_floats(values: impl Iterator<Item = f32>) -> [f32; 2] {
    let of = |[least, most, odd]: [f32; 3], value: f32| {
        [least.min(value), most.max(value), if value.is_finite() { odd } else { 1.0 }]
    };
    let [least, most, odd] = values.fold([f32::INFINITY, f32::NEG_INFINITY, 0.0], of);
    if odd > 0.0 { [least.min(0.0), most.max(0.0)] } else { [least, most] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_of_a_tile_is_that_of_its_values_as_shaders_sample_them() {
        assert_eq!(range_of(LayerFormat::R8, &[51, 255, 102]), [0.2, 1.0]);
        let words: Vec<u8> = [13_107u16, 0, 65_535].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(range_of(LayerFormat::R16, &words), [0.0, 1.0]);
        assert_eq!(range_of(LayerFormat::R16, &words[..2]), [0.2, 0.2]);
        let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        assert_eq!(range_of(LayerFormat::R32Float, &floats(&[2.0, -3.5])), [-3.5, 2.0]);
        assert_eq!(range_of(LayerFormat::R32Float, &floats(&[2.0, f32::NAN])), [0.0, 2.0]);
        assert_eq!(range_of(LayerFormat::R32Float, &floats(&[f32::NAN])), [0.0, 0.0]);
        assert_eq!(range_of(LayerFormat::R32Float, &floats(&[f32::INFINITY, 1.0])), [0.0, f32::MAX]);
        assert_eq!(range_of(LayerFormat::Rgba8, &[1, 2, 3, 4]), ANY);
    }
}
