//! A pool in GPU memory: one texture array for each layer, made of equal slots.
//!
//! How many slots there are and where each lies is [`PoolLayout`]'s business, which tile is in which slot the pager's.

use vastex_core::{ArrayLimits, LayerFormat, PoolLayout, Slot};

use crate::device::{alive, guarded, uniform};
use crate::error::GpuError;
use crate::mirror::PoolParams;
use crate::shader::Atlas;

/// The texture array of one layer.
#[derive(Debug)]
struct LayerArray {
    texture: wgpu::Texture,
    texel_bytes: u32,
}

/// Fixed-size GPU memory for tiles of one size and one set of layer formats.
#[derive(Debug)]
pub struct Pool {
    layout: PoolLayout,
    layers: Vec<LayerArray>,
    view: wgpu::TextureView,
    params: wgpu::Buffer,
    bias: u16,
    atlas: Atlas,
}

/// The GPU's format for a layer, and how shaders read it.
///
/// 16-bit data is filtered by the device where that was asked for ([`crate::required_features`]), else in the shader.
fn gpu_format(format: LayerFormat, features: wgpu::Features) -> (wgpu::TextureFormat, Atlas) {
    use LayerFormat::*;
    use wgpu::TextureFormat as Gpu;
    let norm16 = features.contains(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM);
    let filterable = match format {
        R8 => Gpu::R8Unorm,
        Rg8 => Gpu::Rg8Unorm,
        Rgba8 => Gpu::Rgba8Unorm,
        Rgba8Srgb => Gpu::Rgba8UnormSrgb,
        R16 if norm16 => Gpu::R16Unorm,
        R16 => return (Gpu::R16Uint, Atlas::Uint16),
        Rgba16 if norm16 => Gpu::Rgba16Unorm,
        Rgba16 => return (Gpu::Rgba16Uint, Atlas::Uint16),
        R16Float => Gpu::R16Float,
        Rgba16Float => Gpu::Rgba16Float,
        R32Float => Gpu::R32Float,
        Bc1 => Gpu::Bc1RgbaUnorm,
        Bc1Srgb => Gpu::Bc1RgbaUnormSrgb,
        Bc3 => Gpu::Bc3RgbaUnorm,
        Bc3Srgb => Gpu::Bc3RgbaUnormSrgb,
        Bc4 => Gpu::Bc4RUnorm,
        Bc5 => Gpu::Bc5RgUnorm,
        Bc6h => Gpu::Bc6hRgbUfloat,
        Bc7 => Gpu::Bc7RgbaUnorm,
        Bc7Srgb => Gpu::Bc7RgbaUnormSrgb,
    };
    (filterable, Atlas::Float)
}

impl Pool {
    /// Takes the memory of a pool: [`PoolLayout::bytes`] and a few bytes of parameters.
    ///
    /// `formats` are the layers of every tile, at least one; the first is the one that shaders sample.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &PoolLayout,
        formats: &[LayerFormat],
    ) -> Result<Pool, GpuError> {
        alive(device)?;
        check(device, layout, formats)?;
        let arrays = || formats.iter().map(|&format| layer_array(device, layout, format)).collect::<Vec<_>>();
        let layers = guarded(device, layout.bytes(), arrays)?;
        let Some((&first_format, first)) = formats.first().zip(layers.first()) else {
            return Err(GpuError::PoolFormats {
                texels: texels(layout),
                got: 0,
                expected: layout.tile_bytes,
            });
        };
        let view = first.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let params = uniform(device, queue, "vastex pool", &PoolParams::new(layout, 0));
        let atlas = gpu_format(first_format, device.features()).1;
        Ok(Pool { layout: *layout, layers, view, params, bias: 0, atlas })
    }

    /// Sets the mip bias in force, in eighths of a level. To be called once per frame, before the main pass; costs
    /// an upload of 32 bytes where the bias changed, and returns the bytes sent.
    pub fn set_bias(&mut self, queue: &wgpu::Queue, eighths: u16) -> u64 {
        if self.bias == eighths {
            return 0;
        }
        self.bias = eighths;
        let params = PoolParams::new(&self.layout, eighths);
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        size_of::<PoolParams>() as u64
    }

    /// Puts a tile into a slot: its layers one after the other, each row by row without padding. It is there for all
    /// commands submitted after this call.
    pub fn upload(&self, queue: &wgpu::Queue, slot: Slot, tile: &[u8]) -> Result<(), GpuError> {
        if slot.index() >= self.layout.slots() {
            return Err(GpuError::NoSuchSlot { slot: slot.index(), slots: self.layout.slots() });
        }
        if tile.len() as u64 != self.layout.tile_bytes {
            return Err(GpuError::TileBytes { got: tile.len() as u64, expected: self.layout.tile_bytes });
        }
        let (place, [width, height]) = (self.layout.place(slot), self.layout.tile);
        let mut rest = tile;
        for layer in &self.layers {
            let row = width * layer.texel_bytes;
            let (bytes, others) = rest.split_at(row as usize * height as usize);
            rest = others;
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &layer.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: place.origin[0], y: place.origin[1], z: place.image },
                    aspect: wgpu::TextureAspect::All,
                },
                bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: Some(height),
                },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
        }
        Ok(())
    }

    /// Where the slots lie.
    pub fn layout(&self) -> &PoolLayout {
        &self.layout
    }

    /// How shaders read the sampled layer; decides which [`crate::BindLayout`] and which shader text go with it.
    pub fn atlas(&self) -> Atlas {
        self.atlas
    }

    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    pub(crate) fn params(&self) -> &wgpu::Buffer {
        &self.params
    }
}

fn texels(layout: &PoolLayout) -> u64 {
    u64::from(layout.tile[0]) * u64::from(layout.tile[1])
}

fn check(device: &wgpu::Device, layout: &PoolLayout, formats: &[LayerFormat]) -> Result<(), GpuError> {
    let ArrayLimits { max_side, max_images } = crate::limits(device);
    let ([width, height], images) = (layout.image_size(), layout.images);
    if width.max(height) > max_side || images > max_images {
        return Err(GpuError::PoolLimits { width, height, images, max_side, max_images });
    }
    let texels = texels(layout);
    let got = texels * formats.iter().map(|format| format.texel_bytes() as u64).sum::<u64>();
    if got != layout.tile_bytes {
        return Err(GpuError::PoolFormats { texels, got, expected: layout.tile_bytes });
    }
    Ok(())
}

fn layer_array(device: &wgpu::Device, layout: &PoolLayout, format: LayerFormat) -> LayerArray {
    let [width, height] = layout.image_size();
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vastex pool"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layout.images },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: gpu_format(format, device.features()).0,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    LayerArray { texture, texel_bytes: format.texel_bytes() as u32 }
}
