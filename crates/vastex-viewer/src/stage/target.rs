//! What pictures are drawn into, and the pass that begins with the background.

use glam::Vec4;

use super::kept::KeptPicture;
use super::linear::LinearTarget;

/// The depth buffer of every pass that draws a scene.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Where a picture goes, and by way of what.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    picture: &'a wgpu::TextureView,
    depth: &'a wgpu::TextureView,
    linear: Option<&'a LinearTarget>,
    kept: Option<&'a KeptPicture>,
}

impl<'a> Target<'a> {
    /// Into `picture`, with a depth buffer of the same size; by way of a target of light, if one is given.
    pub fn new(
        picture: &'a wgpu::TextureView,
        depth: &'a wgpu::TextureView,
        linear: Option<&'a LinearTarget>,
    ) -> Target<'a> {
        Target { picture, depth, linear, kept: None }
    }

    /// This target by way of a picture that is kept, if one is given: of the same size and the same formats,
    /// for a target that is given no light, and whose picture is all of a texture of one layer and one level.
    pub fn keeping(self, kept: Option<&'a KeptPicture>) -> Target<'a> {
        Target { kept, ..self }
    }

    /// This target for a picture that the next one follows at once: nothing is kept of it but light.
    pub fn passing(self) -> Target<'a> {
        Target { kept: None, ..self }
    }

    /// What holds the picture after it was encoded, until something else is drawn there; `None` if nothing
    /// but the picture itself does.
    pub fn lasting(&self) -> Option<&'a wgpu::TextureView> {
        self.linear.map(LinearTarget::view).or(self.kept.map(KeptPicture::view))
    }

    /// Brings what was drawn into the picture, where the target has it elsewhere: encodes light, and copies
    /// what is kept. To be recorded after the last pass that draws.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        match (self.linear, self.kept) {
            (Some(linear), _) => linear.encode(encoder, self.picture),
            (None, Some(kept)) => kept.copy(encoder, self.picture),
            (None, None) => {}
        }
    }

    /// A pass that begins with the background, in the values that the target is given, its alpha 0, which
    /// says "not covered".
    pub fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder, background: Vec4) -> wgpu::RenderPass<'e> {
        let [r, g, b, _] = background.as_dvec4().to_array();
        self.pass(encoder, wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 0.0 }))
    }

    /// A pass that continues where another one ended: pixels that it does not draw stay. Depths begin anew.
    pub fn go_on<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        self.pass(encoder, wgpu::LoadOp::Load)
    }

    fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        load: wgpu::LoadOp<wgpu::Color>,
    ) -> wgpu::RenderPass<'e> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.lasting().unwrap_or(self.picture),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }
}

/// A buffer of these bytes, written through the queue.
pub fn filled_buffer(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    bytes: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("scene surface"),
        size: bytes.len() as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// A depth buffer for pictures of a size.
pub fn depth_view(device: &wgpu::Device, size: [u32; 2]) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("scene depth"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: DEPTH_FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
