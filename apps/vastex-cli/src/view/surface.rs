//! Where pictures appear: the surface of a window, kept in step with its size. What is made of its refusals
//! is in `refusals`.

mod refusals;

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use glam::Vec4;
use vastex_scenes::{Gpu, Target, depth_view};
use vastex_viewer::stage::{KeptPicture, LinearTarget, TargetKind};
use vastex_viewer::surface_scene::{PictureFormat, PictureFormats};
use wgpu::CurrentSurfaceTexture;
use winit::window::Window;

use crate::args::Fault;
use crate::report;
use refusals::{Attempt, Refusals};

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
    /// Where it is not, and the window's pictures may be copied into, what those of surfaces are kept in.
    kept: Option<KeptPicture>,
    /// True if there was no memory for it at this size of the window, or the driver refused it otherwise.
    is_kept_refused: bool,
    /// True if it is to be configured before the next picture.
    is_stale: bool,
    /// The frames in a row for which the window gave no picture.
    refusals: Refusals,
    /// What is to go wrong, in tests.
    fault: Option<Fault>,
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
        let able = surface.get_capabilities(&gpu.adapter);
        // On Metal a layer whose pictures may be copied into is not `framebufferOnly`, so that the system may
        // show all of them in a slower way: what that costs was never measured.
        if gpu.adapter.get_info().backend != wgpu::Backend::Metal {
            config.usage |= able.usages & wgpu::TextureUsages::COPY_DST;
        }
        let formats = PictureFormats::new(&gpu.adapter, able.formats, config.format);
        let mut surface = Surface {
            depth: depth_view(&gpu.device, [1, 1]),
            gpu: gpu.clone(),
            window,
            surface: Some(surface),
            config,
            format: formats.straight(wgpu::TextureFormat::Rgba8UnormSrgb),
            formats,
            light: None,
            kept: None,
            is_kept_refused: false,
            is_stale: true,
            refusals: Refusals::default(),
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
        Target::new(picture, &self.depth, self.light.as_ref()).keeping(self.kept.as_ref())
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
            (self.kept, self.is_kept_refused) = (None, false);
            self.is_stale = true;
        }
    }

    /// Keeps pictures from here on, or does not. None is kept where the driver refuses the texture for it, as
    /// without memory.
    pub(super) fn keep_pictures(&mut self, keeps: bool) {
        let can_copy = self.config.usage.contains(wgpu::TextureUsages::COPY_DST);
        if !keeps || !can_copy || self.light.is_some() || self.is_kept_refused {
            self.kept = None;
        } else if self.kept.is_none() {
            let (size, formats) = (self.size(), [self.format.stored, self.format.viewed]);
            let device = &self.gpu.device;
            self.kept = unrefused(device, || KeptPicture::new(device, size, formats)).ok();
            self.is_kept_refused = self.kept.is_none();
        }
    }

    /// A picture to draw, or none at the moment: the window is hidden, shows none in time, or refuses one,
    /// and is asked again in the next frame. Fails where it has refused them for long. `is_lost` says whether
    /// the device is lost: then it is asked for nothing more.
    pub(super) fn acquire(&mut self, is_lost: impl Fn() -> bool) -> Result<Option<SurfaceFrame>> {
        let window = self.window.inner_size();
        if window.width == 0 || window.height == 0 {
            return Ok(None);
        }
        let (frame, refused) = refusals::attempts(|| self.attempt(&is_lost));
        self.fault = None;
        let [width, height] = self.size();
        let of_size = format!("the window gives no picture of {width} x {height} pixels");
        let is_for_long = self.refusals.note(refused.is_some(), Instant::now());
        match refused {
            // The device is the reason, and is made anew.
            Some(_) if is_lost() => {}
            Some(why) if is_for_long => return Err(anyhow!("{of_size}: {why}")),
            Some(why) if self.refusals.is_first() => {
                report::say(&format!("note: {of_size} and is asked again: {why}"));
            }
            _ => {}
        }
        Ok(frame)
    }

    /// Asks the window for a picture once.
    fn attempt(&mut self, device_is_lost: impl Fn() -> bool) -> Attempt<SurfaceFrame> {
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
            // A lost device leaves a surface as it was, and says nothing: what was never configured has no
            // picture, and to ask for one ends the program.
            if device_is_lost() {
                return Attempt::Lost("the device was lost".to_owned());
            }
            self.is_stale = false;
        }
        let texture = match unrefused(&self.gpu.device, || surface.get_current_texture()) {
            Ok(texture) => texture,
            Err(why) => {
                self.is_stale = true;
                return Attempt::Refused(why);
            }
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
                (self.surface, self.is_stale) = (None, true);
                return Attempt::Lost("its surface was lost".to_owned());
            }
            CurrentSurfaceTexture::Outdated => {
                let size = self.window.inner_size();
                self.is_stale = true;
                self.resize([size.width, size.height]);
                return Attempt::Outdated;
            }
            CurrentSurfaceTexture::Validation => {
                self.is_stale = true;
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
