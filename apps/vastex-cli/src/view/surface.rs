//! Where pictures appear: the surface of a window, kept in step with its size.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use glam::Vec4;
use vastex_scenes::{Gpu, Target, depth_view};
use vastex_viewer::stage::{LinearTarget, TargetKind};
use vastex_viewer::surface_scene::{PictureFormat, PictureFormats};
use wgpu::CurrentSurfaceTexture;
use winit::window::Window;

/// A surface, its settings, and a depth buffer of its size.
pub(super) struct Surface {
    gpu: Gpu,
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// What its pictures can be, and are at the moment.
    formats: PictureFormats,
    format: PictureFormat,
    depth: wgpu::TextureView,
    /// Where what is drawn is light, what it is drawn into.
    light: Option<LinearTarget>,
    is_stale: bool,
}

/// A picture that is being drawn.
pub(super) struct SurfaceFrame {
    texture: wgpu::SurfaceTexture,
    pub(super) view: wgpu::TextureView,
}

impl Surface {
    /// Sets the surface of a window up, for pictures of colours.
    pub(super) fn new(gpu: &Gpu, window: Arc<Window>, surface: wgpu::Surface<'static>) -> Result<Surface> {
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&gpu.adapter, 1, 1)
            .context("the adapter cannot draw in this window; draw to a file with `vastex render`")?;
        config.present_mode = wgpu::PresentMode::AutoVsync;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        let formats = PictureFormats::new(&gpu.adapter, formats, config.format);
        let mut surface = Surface {
            depth: depth_view(&gpu.device, [1, 1]),
            gpu: gpu.clone(),
            window,
            surface,
            config,
            format: formats.straight(wgpu::TextureFormat::Rgba8UnormSrgb),
            formats,
            light: None,
            is_stale: true,
        };
        surface.resize([size.width, size.height]);
        Ok(surface)
    }

    /// What its pictures can be.
    pub(super) fn formats(&self) -> &PictureFormats {
        &self.formats
    }

    /// Becomes what pictures of other layers need.
    pub(super) fn set_format(&mut self, format: &PictureFormat) {
        if self.format != *format {
            self.format = format.clone();
            self.is_stale = true;
            self.resize(self.size());
        }
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// What a picture is drawn into.
    pub(super) fn target<'a>(&'a self, picture: &'a wgpu::TextureView) -> Target<'a> {
        Target::new(picture, &self.depth, self.light.as_ref())
    }

    /// The window has another size. One without pixels is not drawn, and keeps the last.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        let max = self.gpu.device.limits().max_texture_dimension_2d;
        let [width, height] = size.map(|side| side.min(max));
        if width > 0 && height > 0 && (self.is_stale || self.size() != [width, height]) {
            (self.config.width, self.config.height) = (width, height);
            self.depth = depth_view(&self.gpu.device, [width, height]);
            let light = || LinearTarget::new(&self.gpu.device, [width, height], self.format.viewed);
            self.light = (self.format.kind == TargetKind::Linear).then(light);
            self.is_stale = true;
        }
    }

    /// A picture to draw, or none at the moment: the window is hidden, or shows none in time.
    pub(super) fn acquire(&mut self) -> Result<Option<SurfaceFrame>> {
        const ATTEMPTS: u32 = 3;
        let window = self.window.inner_size();
        if window.width == 0 || window.height == 0 {
            return Ok(None);
        }
        for _ in 0..ATTEMPTS {
            if std::mem::take(&mut self.is_stale) {
                self.config.format = self.format.stored;
                let is_viewed = self.format.viewed != self.format.stored;
                self.config.view_formats = if is_viewed { vec![self.format.viewed] } else { Vec::new() };
                self.surface.configure(&self.gpu.device, &self.config);
            }
            let texture = match self.surface.get_current_texture() {
                CurrentSurfaceTexture::Success(texture) => texture,
                CurrentSurfaceTexture::Suboptimal(texture) => {
                    self.is_stale = true; // configured anew before the next picture
                    texture
                }
                CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => return Ok(None),
                CurrentSurfaceTexture::Lost => {
                    self.surface = self.gpu.instance.create_surface(self.window.clone())?;
                    self.is_stale = true;
                    continue;
                }
                CurrentSurfaceTexture::Outdated => {
                    let size = self.window.inner_size();
                    self.is_stale = true;
                    self.resize([size.width, size.height]);
                    continue;
                }
                CurrentSurfaceTexture::Validation => bail!("the window gives no picture to draw to"),
            };
            let view = texture.texture.create_view(&wgpu::TextureViewDescriptor {
                format: Some(self.format.viewed),
                ..Default::default()
            });
            return Ok(Some(SurfaceFrame { texture, view }));
        }
        Ok(None)
    }

    /// The format of the views that are drawn to.
    pub(super) fn viewed_format(&self) -> wgpu::TextureFormat {
        self.format.viewed
    }

    /// Fills a picture with one colour, of light.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, frame: &SurfaceFrame, color: Vec4) {
        let [r, g, b, a] = color.to_array().map(f64::from);
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
            store: wgpu::StoreOp::Store,
        };
        let view = &frame.view;
        let attachment =
            wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops };
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        }));
    }

    /// Shows a picture.
    pub(super) fn present(&self, frame: SurfaceFrame) {
        self.window.pre_present_notify();
        self.gpu.queue.present(frame.texture);
    }
}
