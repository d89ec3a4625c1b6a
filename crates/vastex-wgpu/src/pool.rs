//! A pool in GPU memory: one texture for each layer, made of equal slots: an array of 2-D images, or a 3-D
//! texture for the bricks of volumes.
//!
//! How many slots there are and where each lies is [`PoolLayout`]'s business, which tile is in which slot the
//! pager's, in which format a layer is held `layer`'s. Every layer of a page has the same slot; a layer with
//! a fraction of the resolution has a texture of a fraction of the size.

use std::sync::Arc;

use vastex_core::{ArrayLimits, Layer, LayerFormat, PoolLayout, Slot, SlotMove};

use crate::belt::{BeltLayout, BeltTile};
use crate::device::{alive, guarded, uniform};
use crate::error::GpuError;
use crate::fade::Fades;
use crate::filters::VolumeFilters;
use crate::kind::Atlas;
use crate::layer::{BlockRows, block_rows, layer_texels, texture_format, volume_texture_format};
use crate::mirror::PoolParams;
use crate::ranges::Ranges;

/// The texture of one layer.
#[derive(Debug)]
struct LayerTexture {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    atlas: Atlas,
    format: LayerFormat,
    /// Texels of the texture along one of the layer.
    scale: u32,
    /// Size of a slot in the layer's texels, along z 1 in an array.
    tile: [u32; 3],
}

/// Fixed-size GPU memory for tiles of one size and one set of layers.
#[derive(Debug)]
pub struct Pool {
    layout: PoolLayout,
    layers: Vec<LayerTexture>,
    /// How its tiles lie on a belt.
    belt: Arc<BeltLayout>,
    /// What shaders are told.
    params: wgpu::Buffer,
    bias: u16,
    /// What ids show that name no texture.
    unknown: [f32; 4],
    fades: Option<Fades>,
    /// What is known of the values in slots of volumes.
    ranges: Option<Ranges>,
}

impl Pool {
    /// Takes the memory of a pool: [`PoolLayout::bytes`] and a few bytes of parameters.
    ///
    /// `layers` are those of every tile, at least one, in formats that the device holds
    /// ([`held_format`](crate::held_format)).
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &PoolLayout,
        layers: &[Layer],
    ) -> Result<Pool, GpuError> {
        Pool::filtered(device, queue, layout, layers, None)
    }

    /// Makes a pool as [`Pool::new`] does, for a device that filters volumes so; nothing for how it turns out
    /// to ([`VolumeFilters::of`]). Layers of volumes are as [`held_volume_format`](crate::held_volume_format)
    /// says.
    pub fn filtered(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &PoolLayout,
        layers: &[Layer],
        filters: Option<VolumeFilters>,
    ) -> Result<Pool, GpuError> {
        alive(device)?;
        check(device, layout, layers)?;
        let belt = Arc::new(BeltLayout::new(layout.tile, layers).unwrap_or_default());
        let of = layers;
        let solid = layout.is_solid();
        let filters = solid.then(|| filters.unwrap_or_else(|| VolumeFilters::of(device, queue)));
        let textures = || layers.iter().map(|layer| layer_texture(device, layout, layer, filters)).collect();
        let layers: Result<Vec<LayerTexture>, GpuError> = guarded(device, layout.bytes(), textures)?;
        let layers = layers?;
        let unknown = [0.0; 4];
        let params = uniform(device, queue, "vastex pool", &PoolParams::new(layout, 0, unknown));
        let ranges = layout.is_solid().then(|| Ranges::new(device, layout, of));
        Ok(Pool { layout: *layout, layers, belt, params, bias: 0, unknown, fades: None, ranges })
    }

    /// This pool with tiles that may fade in, for shaders in which tiles fade in
    /// ([`Kinds::fade`](crate::Kinds::fade)); costs a byte for each slot.
    pub fn with_fades(self, device: &wgpu::Device) -> Pool {
        Pool { fades: Some(Fades::new(device, &self.layout)), ..self }
    }

    /// How far the pool's tiles have faded in, if they may.
    pub fn fades(&self) -> Option<&Fades> {
        self.fades.as_ref()
    }

    /// How far tiles have faded in, to be changed.
    pub fn fades_mut(&mut self) -> Option<&mut Fades> {
        self.fades.as_mut()
    }

    /// Takes note of the values of a tile that is put into a slot of a pool of volumes, so that rays leap
    /// over what shows nothing; to be [sent](Pool::send_ranges) when the tile is. Costs a look at each value;
    /// nothing for images.
    pub fn set_range(&mut self, slot: Slot, tile: &[u8]) {
        if let Some(ranges) = &mut self.ranges {
            ranges.set(slot, tile);
        }
    }

    /// Sets the range of a slot as [`Pool::set_range`] does, of a tile on a belt, whose values were looked at
    /// when it was put there; costs nothing.
    pub fn set_range_from(&mut self, slot: Slot, tile: &BeltTile) {
        if let Some(ranges) = &mut self.ranges {
            ranges.set_range(slot, tile.range());
        }
    }

    /// Tells the GPU what is known anew of the values in slots, for all commands submitted after this call.
    pub fn send_ranges(&mut self, queue: &wgpu::Queue) {
        if let Some(ranges) = &mut self.ranges {
            ranges.send(queue);
        }
    }

    pub(crate) fn ranges(&self) -> Option<&wgpu::TextureView> {
        self.ranges.as_ref().map(Ranges::view)
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
        let origin = self.layout.origin(slot);
        let mut rest = tile;
        for layer in &self.layers {
            let rows = block_rows(layer.format, layer.tile);
            let (bytes, others) = rest.split_at(rows.rows as usize * rows.row_bytes as usize);
            rest = others;
            layer.upload(queue, origin, bytes, rows);
        }
        Ok(())
    }

    /// Uploads a tile that lies on a belt, for all commands submitted after `encoder`: a copy for each
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
        let (origin, buffer) = (self.layout.origin(slot), tile.buffer());
        for (layer, part) in self.layers.iter().zip(self.belt.parts()) {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: part.to,
                bytes_per_row: Some(part.padded_row_bytes),
                rows_per_image: Some(part.rows.rows_per_image),
            };
            encoder.copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo { buffer, layout },
                layer.copy_info(origin),
                layer.extent(),
            );
        }
        Ok(())
    }

    /// How the pool's tiles lie on a [belt](crate::Belt).
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
            let (from, to) = (other.layout.origin(*from), self.layout.origin(*to));
            for (layer, source) in self.layers.iter().zip(&other.layers) {
                encoder.copy_texture_to_texture(source.copy_info(from), layer.copy_info(to), layer.extent());
            }
        }
        if let (Some(fades), Some(others)) = (&mut self.fades, &other.fades) {
            fades.follow(others, moves);
        }
        if let (Some(ranges), Some(others)) = (&mut self.ranges, &other.ranges) {
            ranges.follow(others, moves);
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

    /// How shaders read layer number `layer`, which exists: [`Kind::atlas`](crate::Kind::atlas).
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

impl LayerTexture {
    /// Where a slot lies, for copies; `origin` is in the texture's texels.
    fn copy_info(&self, origin: [u32; 3]) -> wgpu::TexelCopyTextureInfo<'_> {
        let [x, y] = [origin[0], origin[1]].map(|n| n / self.scale);
        // Images of an array are not scaled.
        let z = if self.tile[2] > 1 { origin[2] / self.scale } else { origin[2] };
        wgpu::TexelCopyTextureInfo {
            texture: &self.texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z },
            aspect: wgpu::TextureAspect::All,
        }
    }

    /// The size of a slot.
    fn extent(&self) -> wgpu::Extent3d {
        let [width, height, depth_or_array_layers] = self.tile;
        wgpu::Extent3d { width, height, depth_or_array_layers }
    }

    fn upload(&self, queue: &wgpu::Queue, origin: [u32; 3], bytes: &[u8], rows: BlockRows) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(rows.row_bytes),
            rows_per_image: Some(rows.rows_per_image),
        };
        queue.write_texture(self.copy_info(origin), bytes, layout, self.extent());
    }
}

fn check(device: &wgpu::Device, layout: &PoolLayout, layers: &[Layer]) -> Result<(), GpuError> {
    let limits = crate::limits(device);
    let ([width, height, depth], ArrayLimits { max_side, max_images, max_side_3d }) = (layout.size(), limits);
    let (max_side, max_images) =
        if layout.is_solid() { (max_side_3d, max_side_3d) } else { (max_side, max_images) };
    if width.max(height) > max_side || depth > max_images {
        return Err(GpuError::PoolLimits { width, height, images: depth, max_side, max_images });
    }
    let layer_bytes = |layer: &Layer| {
        let rows = block_rows(layer.format, layer_texels(layer, layout.tile)?);
        Some(u64::from(rows.rows) * u64::from(rows.row_bytes))
    };
    let got = layers.iter().map(layer_bytes).sum::<Option<u64>>().unwrap_or(0);
    if got != layout.tile_bytes {
        let texels = layout.tile.iter().map(|&side| u64::from(side)).product();
        return Err(GpuError::PoolFormats { texels, got, expected: layout.tile_bytes });
    }
    Ok(())
}

fn layer_texture(
    device: &wgpu::Device,
    layout: &PoolLayout,
    layer: &Layer,
    filters: Option<VolumeFilters>,
) -> Result<LayerTexture, GpuError> {
    let unknown = || GpuError::Format { format: layer.format.name() };
    let features = device.features();
    let format = match filters {
        Some(filters) => volume_texture_format(layer.format, features, filters),
        None => texture_format(layer.format, features),
    };
    let (gpu_format, atlas) = format.ok_or_else(unknown)?;
    let is_solid = layout.is_solid();
    if atlas == Atlas::Whole && !is_solid {
        return Err(GpuError::WholeNumbers { format: layer.format.name() });
    }
    let scaled =
        |[x, y, z]: [u32; 3]| [x / layer.scale, y / layer.scale, if is_solid { z / layer.scale } else { z }];
    let [width, height, depth_or_array_layers] = scaled(layout.size());
    let (dimension, view_dimension) = match is_solid {
        true => (wgpu::TextureDimension::D3, wgpu::TextureViewDimension::D3),
        false => (wgpu::TextureDimension::D2, wgpu::TextureViewDimension::D2Array),
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vastex pool"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension,
        format: gpu_format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture
        .create_view(&wgpu::TextureViewDescriptor { dimension: Some(view_dimension), ..Default::default() });
    let (format, scale, tile) = (layer.format, layer.scale, scaled(layout.tile));
    Ok(LayerTexture { texture, view, atlas, format, scale, tile })
}
