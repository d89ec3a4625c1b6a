//! The pixels of a feedback target, one for each cell of a view: where they lie on the GPU, and as they are
//! on the CPU.
//!
//! Read whole they serve statistics and tests, and where there is no compute every frame (`raw_ring`).

use crate::device::alive;
use crate::error::GpuError;
use crate::mapping::{Answer, Mapping, read_buffer};

/// The format of a feedback target, for the application's feedback pipeline.
pub const FEEDBACK_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
/// Bytes of a pixel.
pub(crate) const PIXEL_BYTES: u32 = 16;

/// The texture that holds the pixels of a feedback target, whichever way they came there.
#[derive(Clone, Debug)]
pub struct RawTexture {
    size: [u32; 2],
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl RawTexture {
    /// A texture of so many pixels, which something fills by `usage`.
    pub(crate) fn new(
        device: &wgpu::Device,
        size: [u32; 2],
        usage: wgpu::TextureUsages,
    ) -> Result<RawTexture, GpuError> {
        let ([width, height], max) = (size, device.limits().max_texture_dimension_2d);
        if size.iter().any(|&side| side == 0 || side > max) {
            return Err(GpuError::TargetSize { width, height, max });
        }
        let readable = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let texture = new_texture(device, size, FEEDBACK_FORMAT, usage | readable);
        let view = texture.create_view(&Default::default());
        Ok(RawTexture { size, texture, view })
    }

    /// Another texture of the same size.
    pub(crate) fn beside(
        &self,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        new_texture(device, self.size, format, usage)
    }

    /// Size in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// For shaders that show it.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    fn row_bytes(&self) -> u32 {
        (self.size[0] * PIXEL_BYTES).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
    }

    /// Bytes of a buffer that it can be copied into.
    pub(crate) fn copy_bytes(&self) -> u64 {
        u64::from(self.row_bytes()) * u64::from(self.size[1])
    }

    /// Records the copy of all pixels into such a buffer.
    pub(crate) fn copy_to(&self, encoder: &mut wgpu::CommandEncoder, buffer: &wgpu::Buffer) -> Mapping {
        let bytes_per_row = Some(self.row_bytes());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer, layout },
            extent(self.size),
        );
        Mapping::on_submit(encoder, buffer, self.copy_bytes())
    }

    /// Records the copy of one pixel into a buffer of [`PIXEL_BYTES`].
    pub(crate) fn copy_pixel_to(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffer: &wgpu::Buffer,
        [x, y]: [u32; 2],
    ) -> Mapping {
        let origin = wgpu::Origin3d { x, y, z: 0 };
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None };
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { origin, ..self.texture.as_image_copy() },
            wgpu::TexelCopyBufferInfo { buffer, layout },
            extent([1, 1]),
        );
        Mapping::on_submit(encoder, buffer, PIXEL_BYTES.into())
    }

    /// The pixels in a copy, row by row.
    pub(crate) fn pixels(&self, copy: &[u8]) -> Vec<[u32; 4]> {
        let row = self.size[0] as usize * PIXEL_BYTES as usize;
        let rows = copy.chunks_exact(self.row_bytes() as usize);
        rows.flat_map(|bytes| bytes[..row].chunks_exact(PIXEL_BYTES as usize))
            .map(bytemuck::pod_read_unaligned)
            .collect()
    }
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}

fn new_texture(
    device: &wgpu::Device,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("vastex feedback"),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// The pixels of a feedback target, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawFeedback {
    /// Size in pixels.
    pub size: [u32; 2],
    /// Each pixel as `vastex_feedback` wrote it: page id low, page id high, eighth, flag.
    pub pixels: Vec<[u32; 4]>,
}

impl RawFeedback {
    /// Reads a target after its pass was submitted. Blocks; for statistics and tests, at 16 bytes a pixel.
    pub fn read(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        raw: &RawTexture,
    ) -> Result<RawFeedback, GpuError> {
        alive(device)?;
        let buffer = read_buffer(device, raw.copy_bytes());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mapping = raw.copy_to(&mut encoder, &buffer);
        queue.submit([encoder.finish()]);
        if mapping.wait(device, queue, &buffer)? != Answer::Mapped {
            return Err(GpuError::DeviceLost);
        }
        let pixels = mapping.read(&buffer, |bytes| raw.pixels(bytes))?;
        Ok(RawFeedback { size: raw.size(), pixels })
    }
}
