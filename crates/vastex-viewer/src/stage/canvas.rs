//! What pictures without a window of their own are drawn on, to be read back or painted by others.

use super::linear::{LinearTarget, TargetKind};
use super::target::{Target, depth_view};
use crate::gpu::Gpu;

/// A picture on the GPU, a depth buffer of its size and, where it is drawn as light, the target for that.
#[derive(Debug)]
pub struct Canvas {
    size: [u32; 2],
    colour: wgpu::Texture,
    colour_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
    linear: Option<LinearTarget>,
}

impl Canvas {
    /// For pictures of `size` pixels and of the 8-bit format `picture`. Takes 8 bytes a pixel, and 8 more
    /// where it is drawn as light.
    pub fn new(gpu: &Gpu, size: [u32; 2], picture: wgpu::TextureFormat, kind: TargetKind) -> Canvas {
        let colour = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: picture,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let linear = (kind == TargetKind::Linear).then(|| LinearTarget::new(&gpu.device, size, picture));
        let colour_view = colour.create_view(&Default::default());
        Canvas { size, colour, colour_view, depth_view: depth_view(&gpu.device, size), linear }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What frames are drawn into.
    pub fn target(&self) -> Target<'_> {
        Target::new(&self.colour_view, &self.depth_view, self.linear.as_ref())
    }

    /// The picture itself.
    pub fn picture(&self) -> &wgpu::Texture {
        &self.colour
    }
}
