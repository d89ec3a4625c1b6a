//! Where the level that a view needs is drawn in texture space, and its way back to the CPU.
//!
//! What a texel says is the shader's business (texture_space.wgsl), what follows from it that of
//! [`LevelImage`].

use vastex_core::{Geometry, LevelImage};

use crate::device::alive;
use crate::error::GpuError;
use crate::mapping::{Answer, Mapping, read_buffer};

/// The format of a target, for the application's pipeline.
pub const TEXTURE_SPACE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;
/// How the application's pipeline blends: where surfaces overlap, the sharpest stays.
pub const TEXTURE_SPACE_BLEND: wgpu::BlendState = {
    let largest = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Max,
    };
    wgpu::BlendState { color: largest, alpha: largest }
};

/// Texels of a target along an axis at most.
const MOST_TEXELS: u32 = 256;
/// Texels along a page of level 0, where there is room.
const TEXELS_PER_PAGE: u32 = 4;
/// Frames whose levels can be under way at once.
const RING: usize = 4;

/// A target for one texture. At most 64 KiB on the GPU, and four times that on the way back.
#[derive(Debug)]
pub struct TextureSpace {
    size: [u32; 2],
    target: wgpu::Texture,
    view: wgpu::TextureView,
    ring: Vec<Place>,
}

/// One place of the ring.
#[derive(Debug)]
struct Place {
    mapped: wgpu::Buffer,
    under_way: Option<(u64, Mapping)>,
}

impl TextureSpace {
    /// A target for a texture of this shape.
    pub fn new(device: &wgpu::Device, geometry: &Geometry) -> Result<TextureSpace, GpuError> {
        alive(device)?;
        let pages = geometry.level(0).pages;
        let size = [0, 1].map(|axis| pages[axis].saturating_mul(TEXELS_PER_PAGE).min(MOST_TEXELS));
        let target = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("vastex texture space"),
            size: extent(size),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TEXTURE_SPACE_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let bytes = u64::from(row_bytes(size)) * u64::from(size[1]);
        let ring = (0..RING).map(|_| Place { mapped: read_buffer(device, bytes), under_way: None });
        Ok(TextureSpace { size, view: target.create_view(&Default::default()), ring: ring.collect(), target })
    }

    /// Begins the pass. The caller draws with a pipeline of [`TEXTURE_SPACE_FORMAT`] that blends by
    /// [`TEXTURE_SPACE_BLEND`] and culls nothing, without a depth buffer.
    pub fn begin<'encoder>(&self, encoder: &'encoder mut wgpu::CommandEncoder) -> wgpu::RenderPass<'encoder> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("vastex texture space"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        })
    }

    /// Records the copy of what was drawn. `frame` grows from call to call. Returns true if there was room:
    /// where the GPU is several frames behind, a frame is left out rather than waited for. Where the commands
    /// are dropped, their frame is left out too.
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder, frame: u64) -> bool {
        for place in &mut self.ring {
            place.under_way.take_if(|(_, mapping)| mapping.answer() == Ok(Answer::Dropped));
        }
        let Some(place) = self.ring.iter_mut().find(|place| place.under_way.is_none()) else { return false };
        encoder.copy_texture_to_buffer(
            self.target.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &place.mapped,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes(self.size)),
                    rows_per_image: None,
                },
            },
            extent(self.size),
        );
        let mapping = Mapping::on_submit(encoder, &place.mapped, place.mapped.size());
        place.under_way = Some((frame, mapping));
        true
    }

    /// The newest levels that have arrived since they were asked for last, with their frame. Never waits;
    /// what has arrived shows when the device is [polled](crate::poll).
    pub fn poll(&mut self) -> Result<Option<(u64, LevelImage)>, GpuError> {
        self.newest(u64::MAX)
    }

    /// The newest levels of `frame` or before. Blocks until they have arrived. Not for browsers, where
    /// nothing can be waited for.
    pub fn wait(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: u64,
    ) -> Result<Option<(u64, LevelImage)>, GpuError> {
        for place in &self.ring {
            if let Some((_, mapping)) = place.under_way.as_ref().filter(|(of, _)| *of <= frame) {
                mapping.wait(device, queue, &place.mapped)?;
            }
        }
        self.newest(frame)
    }

    /// Takes in every copy that has arrived, of frames up to `last`.
    fn newest(&mut self, last: u64) -> Result<Option<(u64, LevelImage)>, GpuError> {
        let mut newest: Option<(u64, LevelImage)> = None;
        for place in &mut self.ring {
            let Some((frame, mapping)) = place.under_way.take() else { continue };
            if frame > last || mapping.answer()? != Answer::Mapped {
                place.under_way = Some((frame, mapping));
                continue;
            }
            let (size, row) = (self.size, row_bytes(self.size) as usize);
            let texels = mapping.read(&place.mapped, |bytes| {
                bytes.chunks_exact(row).flat_map(|row| &row[..size[0] as usize]).copied().collect()
            })?;
            if newest.as_ref().is_none_or(|(of, _)| *of < frame) {
                newest = Some((frame, LevelImage::new(size, texels)));
            }
        }
        Ok(newest)
    }
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}

fn row_bytes(size: [u32; 2]) -> u32 {
    size[0].next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
