//! A pool in GPU memory: one texture array for each layer, made of equal slots.
//!
//! How many slots there are and where each lies is [`PoolLayout`]'s business, which tile is in which slot the
//! pager's, in which format a layer is held `layer`'s. Every layer of a page has the same slot; a layer with
//! a fraction of the resolution has an array of a fraction of the size.

use std::sync::Arc;

use vastex_core::{ArrayLimits, Layer, LayerFormat, PoolLayout, Slot, SlotMove, SlotPlace};

use crate::belt::{BeltLayout, BeltTile};
use crate::device::{alive, guarded, uniform};
use crate::error::GpuError;
use crate::fade::Fades;
use crate::kind::Atlas;
use crate::layer::{block_rows, layer_texels, texture_format};
use crate::mirror::PoolParams;

/// The texture array of one layer.
#[derive(Debug)]
struct LayerArray {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    atlas: Atlas,
    format: LayerFormat,
    /// Texels of the texture along one of the layer.
    scale: u32,
    /// Size of a slot in the layer's texels.
    tile: [u32; 2],
}

/// Fixed-size GPU memory for tiles of one size and one set of layers.
#[derive(Debug)]
pub struct Pool {
    layout: PoolLayout,
    layers: Vec<LayerArray>,
    /// How its tiles lie on a belt.
    belt: Arc<BeltLayout>,
    /// What shaders are told.
    params: wgpu::Buffer,
    bias: u16,
    /// What ids show that name no texture.
    unknown: [f32; 4],
    fades: Option<Fades>,
}

impl Pool {
    /// Takes the memory of a pool: [`PoolLayout::bytes`] and a few bytes of parameters.
    ///
    /// `layers` are those of every tile, at least one, in formats that the device holds
    /// ([`crate::held_format`]).
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &PoolLayout,
        layers: &[Layer],
    ) -> Result<Pool, GpuError> {
        alive(device)?;
        check(device, layout, layers)?;
        let belt = Arc::new(BeltLayout::new(layout.tile, layers).unwrap_or_default());
        let arrays = || layers.iter().map(|layer| layer_array(device, layout, layer)).collect();
        let layers: Result<Vec<LayerArray>, GpuError> = guarded(device, layout.bytes(), arrays)?;
        let layers = layers?;
        let unknown = [0.0; 4];
        let params = uniform(device, queue, "vastex pool", &PoolParams::new(layout, 0, unknown));
        Ok(Pool { layout: *layout, layers, belt, params, bias: 0, unknown, fades: None })
    }

    /// The same with tiles that may fade in, for shaders in which tiles fade in ([`crate::Kinds::fade`]);
    /// costs a byte for each slot.
    pub fn with_fades(self, device: &wgpu::Device) -> Pool {
        Pool { fades: Some(Fades::new(device, &self.layout)), ..self }
    }

    /// How far its tiles have faded in, if they may.
    pub fn fades(&self) -> Option<&Fades> {
        self.fades.as_ref()
    }

    /// The same, to be changed.
    pub fn fades_mut(&mut self) -> Option<&mut Fades> {
        self.fades.as_mut()
    }

    /// The mip bias in force, in eighths of a level.
    pub fn bias(&self) -> u16 {
        self.bias
    }

    /// Sets the mip bias in force, in eighths of a level. To be called once per frame, before the main pass;
    /// costs an upload of 64 bytes where the bias changed, and returns the bytes sent.
    pub fn set_bias(&mut self, queue: &wgpu::Queue, eighths: u16) -> u64 {
        if self.bias == eighths {
            return 0;
        }
        self.bias = eighths;
        self.send_params(queue)
    }

    /// Sets the colour, or values, that shaders show where an id names no texture, for all commands submitted
    /// after this call: zeros unless it is set.
    pub fn set_unknown(&mut self, queue: &wgpu::Queue, color: [f32; 4]) {
        self.unknown = color;
        self.send_params(queue);
    }

    fn send_params(&self, queue: &wgpu::Queue) -> u64 {
        let params = PoolParams::new(&self.layout, self.bias, self.unknown);
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        size_of::<PoolParams>() as u64
    }

    /// Puts a tile into a slot: its layers one after the other, each row by row without padding. It is there
    /// for all commands submitted after this call.
    pub fn upload(&self, queue: &wgpu::Queue, slot: Slot, tile: &[u8]) -> Result<(), GpuError> {
        self.check_slot(slot)?;
        if tile.len() as u64 != self.layout.tile_bytes {
            return Err(GpuError::TileBytes { got: tile.len() as u64, expected: self.layout.tile_bytes });
        }
        let place = self.layout.place(slot);
        let mut rest = tile;
        for layer in &self.layers {
            let (rows, row_bytes) = block_rows(layer.format, layer.tile);
            let (bytes, others) = rest.split_at(rows as usize * row_bytes as usize);
            rest = others;
            layer.upload(queue, place, bytes, row_bytes);
        }
        Ok(())
    }

    /// The same for a tile that lies on a belt, for all commands submitted after `encoder`: a copy for each
    /// layer, and nothing is made or copied on the CPU. The tile is kept until these commands are submitted.
    pub fn upload_from(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        slot: Slot,
        tile: &BeltTile,
    ) -> Result<(), GpuError> {
        self.check_slot(slot)?;
        if *tile.layout() != *self.belt {
            return Err(GpuError::TileBytes {
                got: tile.layout().tile_bytes(),
                expected: self.layout.tile_bytes,
            });
        }
        let (place, buffer) = (self.layout.place(slot), tile.buffer());
        for (layer, part) in self.layers.iter().zip(self.belt.parts()) {
            let [width, height] = layer.tile;
            let bytes_per_row = Some(part.padded_row_bytes);
            let layout = wgpu::TexelCopyBufferLayout { offset: part.to, bytes_per_row, rows_per_image: None };
            encoder.copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo { buffer, layout },
                layer.copy_info(place),
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
        }
        Ok(())
    }

    /// How its tiles lie on a [belt](crate::Belt).
    pub fn belt_layout(&self) -> &Arc<BeltLayout> {
        &self.belt
    }

    fn check_slot(&self, slot: Slot) -> Result<(), GpuError> {
        let slots = self.layout.slots();
        if slot.index() < slots { Ok(()) } else { Err(GpuError::NoSuchSlot { slot: slot.index(), slots }) }
    }

    /// Copies tiles of another pool with the same layers into this one, for all commands submitted after
    /// `encoder`, and how far they have faded in, to be [sent](Fades::send). Slots that one of the pools does
    /// not have are left out. Costs a copy for each tile and layer.
    pub fn copy_from(&mut self, encoder: &mut wgpu::CommandEncoder, other: &Pool, moves: &[SlotMove]) {
        let has = |pool: &Pool, slot: Slot| slot.index() < pool.layout.slots();
        for SlotMove { from, to } in moves.iter().filter(|m| has(other, m.from) && has(self, m.to)) {
            let (from, to) = (other.layout.place(*from), self.layout.place(*to));
            for (layer, source) in self.layers.iter().zip(&other.layers) {
                let [width, height] = layer.tile;
                encoder.copy_texture_to_texture(
                    source.copy_info(from),
                    layer.copy_info(to),
                    wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                );
            }
        }
        if let (Some(fades), Some(others)) = (&mut self.fades, &other.fades) {
            fades.follow(others, moves);
        }
    }

    /// Where the slots lie.
    pub fn layout(&self) -> &PoolLayout {
        &self.layout
    }

    /// Number of layers, at least 1.
    pub fn layer_count(&self) -> usize {
        self.layers.len()
    }

    /// How shaders read layer number `layer`, which exists: [`crate::Kind::atlas`].
    pub fn atlas(&self, layer: usize) -> Atlas {
        self.layers[layer].atlas
    }

    pub(crate) fn view(&self, layer: usize) -> &wgpu::TextureView {
        &self.layers[layer].view
    }

    pub(crate) fn params(&self) -> &wgpu::Buffer {
        &self.params
    }
}

impl LayerArray {
    /// Where a slot lies, for copies.
    fn copy_info(&self, place: SlotPlace) -> wgpu::TexelCopyTextureInfo<'_> {
        let [x, y] = place.origin.map(|n| n / self.scale);
        wgpu::TexelCopyTextureInfo {
            texture: &self.texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z: place.image },
            aspect: wgpu::TextureAspect::All,
        }
    }

    fn upload(&self, queue: &wgpu::Queue, place: SlotPlace, bytes: &[u8], row_bytes: u32) {
        let [width, height] = self.tile;
        queue.write_texture(
            self.copy_info(place),
            bytes,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
}

fn check(device: &wgpu::Device, layout: &PoolLayout, layers: &[Layer]) -> Result<(), GpuError> {
    let ArrayLimits { max_side, max_images } = crate::limits(device);
    let ([width, height], images) = (layout.image_size(), layout.images);
    if width.max(height) > max_side || images > max_images {
        return Err(GpuError::PoolLimits { width, height, images, max_side, max_images });
    }
    let layer_bytes = |layer: &Layer| {
        let (rows, row_bytes) = block_rows(layer.format, layer_texels(layer, layout.tile)?);
        Some(u64::from(rows) * u64::from(row_bytes))
    };
    let got = layers.iter().map(layer_bytes).sum::<Option<u64>>().unwrap_or(0);
    if got != layout.tile_bytes {
        let texels = u64::from(layout.tile[0]) * u64::from(layout.tile[1]);
        return Err(GpuError::PoolFormats { texels, got, expected: layout.tile_bytes });
    }
    Ok(())
}

fn layer_array(device: &wgpu::Device, layout: &PoolLayout, layer: &Layer) -> Result<LayerArray, GpuError> {
    let unknown = || GpuError::Format { format: layer.format.name() };
    let (gpu_format, atlas) = texture_format(layer.format, device.features()).ok_or_else(unknown)?;
    let [width, height] = layout.image_size().map(|side| side / layer.scale);
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vastex pool"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layout.images },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: gpu_format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    });
    let tile = layout.tile.map(|side| side / layer.scale);
    Ok(LayerArray { texture, view, atlas, format: layer.format, scale: layer.scale, tile })
}
