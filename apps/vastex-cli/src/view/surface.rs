//! Where pictures appear: the surface of a window, kept in step with its size.

use std::sync::Arc;

use anyhow::{Context, Result};
use glam::Vec4;
use vastex_scenes::{Gpu, Target, depth_view};
use vastex_viewer::stage::{LinearTarget, TargetKind};
use vastex_viewer::surface_scene::{PictureFormat, PictureFormats};
use wgpu::CurrentSurfaceTexture;
use winit::window::Window;

use crate::args::Fault;
use crate::report;

/// A surface, its settings, and a depth buffer of its size.
pub(super) struct Surface {
    gpu: Gpu,
    window: Arc<Window>,
    /// None after it was lost, until there is another.
    surface: Option<wgpu::Surface<'static>>,
    config: wgpu::SurfaceConfiguration,
    /// What its pictures can be, and are at the moment.
    formats: PictureFormats,
    format: PictureFormat,
    depth: wgpu::TextureView,
    /// Where what is drawn is light, what it is drawn into.
    light: Option<LinearTarget>,
    /// True if it is to be configured before the next picture.
    is_stale: bool,
    /// True if the window refused the last picture that it was asked for, and that was said.
    is_refused: bool,
    /// What is to go wrong, in tests.
    fault: Option<Fault>,
}

/// What comes of asking the window for a picture.
enum Attempt {
    Picture(SurfaceFrame),
    /// There is none at the moment, and asking again is of no use.
    NoneNow,
    /// The surface is of another size of the window.
    Outdated,
    /// Why there is none; another attempt may have one.
    Refused(String),
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
            surface: Some(surface),
            config,
            format: formats.straight(wgpu::TextureFormat::Rgba8UnormSrgb),
            formats,
            light: None,
            is_stale: true,
            is_refused: false,
            fault: None,
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

    /// A picture to draw, or none at the moment: the window is hidden, shows none in time, or refuses one,
    /// and is asked again in the next frame.
    pub(super) fn acquire(&mut self) -> Option<SurfaceFrame> {
        const ATTEMPTS: u32 = 3;
        let window = self.window.inner_size();
        if window.width == 0 || window.height == 0 {
            return None;
        }
        let (mut refused, mut frame) = (None, None);
        for _ in 0..ATTEMPTS {
            match self.attempt() {
                Attempt::Picture(picture) => {
                    frame = Some(picture);
                    break;
                }
                Attempt::NoneNow => break,
                Attempt::Outdated => {}
                Attempt::Refused(why) => {
                    refused = Some(why);
                    self.is_stale = true;
                }
            }
        }
        self.fault = None;
        self.tell(refused);
        frame
    }

    /// Says why the window refused a picture, once until it gives one without.
    fn tell(&mut self, refused: Option<String>) {
        let was_refused = std::mem::replace(&mut self.is_refused, refused.is_some());
        if let Some(why) = refused.filter(|_| !was_refused) {
            let [width, height] = self.size();
            report::say(&format!(
                "note: the window gives no picture of {width} x {height} pixels and is asked again: {why}"
            ));
        }
    }

    /// Asks the window for a picture once.
    fn attempt(&mut self) -> Attempt {
        let surface = match self.surface.take() {
            Some(surface) => surface,
            None => match self.gpu.instance.create_surface(self.window.clone()) {
                Ok(surface) => surface,
                Err(error) => return Attempt::Refused(error.to_string()),
            },
        };
        let surface = self.surface.insert(surface);
        if self.is_stale {
            self.config.format = self.format.stored;
            let is_viewed = self.format.viewed != self.format.stored;
            self.config.view_formats = if is_viewed { vec![self.format.viewed] } else { Vec::new() };
            // What has no columns is refused.
            let width = if self.fault == Some(Fault::Configuration) { 0 } else { self.config.width };
            let config = wgpu::SurfaceConfiguration { width, ..self.config.clone() };
            // What another thread hands to the device meanwhile is enough for a refusal.
            if let Err(why) = unrefused(&self.gpu.device, || surface.configure(&self.gpu.device, &config)) {
                return Attempt::Refused(why);
            }
            self.is_stale = false;
        }
        let texture = match unrefused(&self.gpu.device, || surface.get_current_texture()) {
            Ok(texture) => texture,
            Err(why) => return Attempt::Refused(why),
        };
        let is_lost = self.fault.take_if(|fault| *fault == Fault::Surface).is_some();
        let texture = match texture {
            CurrentSurfaceTexture::Success(texture) | CurrentSurfaceTexture::Suboptimal(texture)
                if is_lost =>
            {
                drop(texture);
                CurrentSurfaceTexture::Lost
            }
            texture => texture,
        };
        let texture = match texture {
            CurrentSurfaceTexture::Success(texture) => texture,
            CurrentSurfaceTexture::Suboptimal(texture) => {
                self.is_stale = true; // configured anew before the next picture
                texture
            }
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => return Attempt::NoneNow,
            CurrentSurfaceTexture::Lost => {
                // A window has one surface at a time.
                self.surface = None;
                return Attempt::Refused("its surface was lost".to_owned());
            }
            CurrentSurfaceTexture::Outdated => {
                let size = self.window.inner_size();
                self.is_stale = true;
                self.resize([size.width, size.height]);
                return Attempt::Outdated;
            }
            CurrentSurfaceTexture::Validation => {
                return Attempt::Refused("the device refuses it".to_owned());
            }
        };
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(self.format.viewed),
            ..Default::default()
        });
        Attempt::Picture(SurfaceFrame { texture, view })
    }

    /// Has something go wrong with it once, for tests.
    pub(super) fn suffer(&mut self, fault: Fault) {
        self.fault = Some(fault);
        self.is_stale |= fault == Fault::Configuration;
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

/// What comes of using the device, or why it refuses that. Without this a refusal would end the program.
fn unrefused<T>(device: &wgpu::Device, act: impl FnOnce() -> T) -> Result<T, String> {
    let filters =
        [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation];
    let scopes = filters.map(|filter| device.push_error_scope(filter));
    let done = act();
    let errors = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
    match errors.collect::<Vec<_>>().into_iter().flatten().next() {
        Some(error) => Err(on_one_line(&error)),
        None => Ok(done),
    }
}

/// The reasons of an error after one another.
fn on_one_line(error: &wgpu::Error) -> String {
    error.to_string().lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}
