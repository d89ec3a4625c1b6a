//! Draws what egui made of panels over a picture, and shows pictures of the host's own in them.

mod changes;

use egui::epaint::ClippedPrimitive;
use egui::{Context, FullOutput, TextureId};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};

use crate::gpu::Gpu;
use changes::TextureChanges;

/// What draws the panels of one window. The same one goes on from frame to frame, and from one device to the
/// next.
#[derive(Default)]
pub struct PanelPainter {
    /// What draws, on one device and into pictures of one format; made where it is first needed.
    renderer: Option<(Renderer, wgpu::TextureFormat)>,
    /// How many there have been.
    renderers: u64,
    /// Pictures of the host's own, each with the number of the renderer that knows it.
    pictures: Vec<(u64, TextureId)>,
    /// Textures of egui, and what of them has changed since the renderer drew.
    textures: TextureChanges,
    jobs: Vec<ClippedPrimitive>,
    pixels_per_point: f32,
}

impl PanelPainter {
    /// The device is another from here on.
    pub fn forget_device(&mut self) {
        self.renderer = None;
    }

    /// Takes what a run of egui put into the window, which is drawn next: its shapes and changes of textures.
    pub fn take(&mut self, context: &Context, output: &mut FullOutput) {
        self.pixels_per_point = output.pixels_per_point;
        self.jobs = context.tessellate(std::mem::take(&mut output.shapes), self.pixels_per_point);
        let set = std::mem::take(&mut output.textures_delta.set);
        let set = set.into_iter().flat_map(|(id, deltas)| deltas.into_iter().map(move |delta| (id, delta)));
        self.textures.add(set, std::mem::take(&mut output.textures_delta.free));
    }

    /// Makes what draws into pictures of a format, where there is none yet or the last one was for another
    /// format.
    fn prepare(&mut self, gpu: &Gpu, format: wgpu::TextureFormat) {
        if self.renderer.as_ref().is_some_and(|(_, of)| *of == format) {
            return;
        }
        self.textures.begin_again();
        self.renderers += 1;
        self.renderer = Some((Renderer::new(&gpu.device, format, RendererOptions::default()), format));
    }

    /// Makes pictures of the host's own known to what draws into pictures of a format, in the place of those
    /// before. Gives their names, and a number: where [`PanelPainter::number_of`] gives another one, the
    /// names are no longer good.
    pub fn show_pictures(
        &mut self,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        views: &[&wgpu::TextureView],
    ) -> (Vec<TextureId>, u64) {
        self.prepare(gpu, format);
        let names = match &mut self.renderer {
            Some((renderer, _)) => {
                // What another one drew with went with it.
                let of_this = self.renderers;
                for (of, name) in self.pictures.drain(..) {
                    if of == of_this {
                        renderer.free_texture(&name);
                    }
                }
                let register = |view: &&wgpu::TextureView| {
                    renderer.register_native_texture(&gpu.device, view, wgpu::FilterMode::Linear)
                };
                views.iter().map(register).collect()
            }
            None => Vec::new(),
        };
        self.pictures.extend(names.iter().map(|name| (self.renderers, *name)));
        (names, self.renderers)
    }

    /// The number of what would draw into pictures of a format, of all that ever did; `None` if a new one is
    /// to be made.
    pub fn number_of(&self, format: wgpu::TextureFormat) -> Option<u64> {
        self.renderer.as_ref().filter(|(_, of)| *of == format).map(|_| self.renderers)
    }

    /// Draws what was taken last over a picture of so many pixels, of a format.
    pub fn paint(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (picture, format): (&wgpu::TextureView, wgpu::TextureFormat),
        size: [u32; 2],
    ) {
        let Gpu { device, queue, .. } = gpu;
        self.prepare(gpu, format);
        let Some((renderer, _)) = &mut self.renderer else { return };
        for (id, delta) in self.textures.take_changed() {
            renderer.update_texture(device, queue, id, &delta);
        }
        let screen = ScreenDescriptor { size_in_pixels: size, pixels_per_point: self.pixels_per_point };
        // There are no callbacks that would have commands of their own.
        renderer.update_buffers(device, queue, encoder, &self.jobs, &screen);
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let attachment =
            wgpu::RenderPassColorAttachment { view: picture, depth_slice: None, resolve_target: None, ops };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panels"),
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        renderer.render(&mut pass.forget_lifetime(), &self.jobs, &screen);
        for id in self.textures.take_gone() {
            renderer.free_texture(&id);
        }
    }
}
