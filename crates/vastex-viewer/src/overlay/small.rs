//! Small pictures of the machine, to be shown beside the picture.

use vastex::{Error, Textures};

use super::{Overlay, OverlayRenderer};
use crate::camera::Pose;
use crate::gpu::Gpu;
use crate::stage::{LinearTarget, Target, TargetKind, depth_view};
use crate::surface::SceneRenderer;

/// Width and height in pixels.
const SIZE: [u32; 2] = [352, 176];

/// An overlay, small, in a texture of its own.
#[derive(Debug)]
pub struct SmallOverlay {
    renderer: OverlayRenderer,
    drawn: wgpu::TextureView,
    shown: wgpu::TextureView,
    depth: wgpu::TextureView,
    light: Option<LinearTarget>,
}

impl SmallOverlay {
    /// Prepares an overlay of what a renderer draws, for a picture of a format, by way of light or not, as
    /// the renderer's own are. Made anew where the renderer is. Fails where the texture was removed.
    pub fn new(
        gpu: &Gpu,
        textures: &Textures,
        renderer: &SceneRenderer,
        overlay: Overlay,
        picture: wgpu::TextureFormat,
    ) -> Result<SmallOverlay, Error> {
        let device = &gpu.device;
        let stored = picture.remove_srgb_suffix();
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("small overlay"),
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: picture,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: if stored == picture { &[] } else { std::slice::from_ref(&stored) },
        });
        let view = |format| {
            texture.create_view(&wgpu::TextureViewDescriptor { format: Some(format), ..Default::default() })
        };
        let is_linear = TargetKind::Linear.drawn_format(picture) == renderer.format();
        Ok(SmallOverlay {
            renderer: OverlayRenderer::new(device, textures, renderer, overlay)?,
            drawn: view(picture),
            shown: view(stored),
            depth: depth_view(device, SIZE),
            light: is_linear.then(|| LinearTarget::new(device, SIZE, picture)),
        })
    }

    /// Which overlay it is.
    pub fn overlay(&self) -> Overlay {
        self.renderer.overlay()
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        SIZE
    }

    /// The picture, in display values.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.shown
    }

    /// Draws the overlay as the pools and tables are now, between two frames: moves the camera of the
    /// renderer, and submits a pass of its own.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        textures: &Textures,
        renderer: &SceneRenderer,
        pose: &Pose,
    ) -> Result<(), Error> {
        renderer.set_pose(&gpu.queue, textures, pose, SIZE);
        self.renderer.look(&gpu.device, &gpu.queue, textures, renderer, SIZE)?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let target = Target::new(&self.drawn, &self.depth, self.light.as_ref());
        self.renderer.draw(&mut encoder, renderer, textures, &target);
        target.encode(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}
