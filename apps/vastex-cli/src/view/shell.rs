//! egui in the window: it hears events first, runs once in each frame, and is drawn over the picture.
//!
//! What is in the panels is `panel`'s business.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::epaint::{ClippedPrimitive, ColorImage, ImageData, ImageDelta};
use egui::{Context, TextureId, TextureOptions, Ui, ViewportId};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use vastex_scenes::Gpu;
use winit::event::WindowEvent;
use winit::window::Window;

/// What egui makes of an event.
#[derive(Clone, Copy, Default)]
pub(super) struct Heard {
    /// Whether it is of a panel, and of nothing else.
    pub(super) is_taken: bool,
    /// Whether a frame is due for it.
    pub(super) is_stale: bool,
}

/// egui in one window.
pub(super) struct Shell {
    window: Arc<Window>,
    state: egui_winit::State,
    /// What draws, on one device and into one format; made where it is first needed.
    painter: Option<Painter>,
    /// What its textures are, for another painter.
    images: HashMap<TextureId, (ColorImage, TextureOptions)>,
    /// What of them has changed since the painter drew, and which are not needed from then on.
    changed: Vec<(TextureId, ImageDelta)>,
    gone: Vec<TextureId>,
    jobs: Vec<ClippedPrimitive>,
    pixels_per_point: f32,
    /// When it wants to run again.
    due: Option<Instant>,
    was_over: bool,
}

struct Painter {
    renderer: Renderer,
    format: wgpu::TextureFormat,
}

impl Shell {
    pub(super) fn new(window: Arc<Window>) -> Shell {
        let context = Context::default();
        let state = egui_winit::State::new(context, ViewportId::ROOT, &window, None, window.theme(), None);
        Shell {
            window,
            state,
            painter: None,
            images: HashMap::new(),
            changed: Vec::new(),
            gone: Vec::new(),
            jobs: Vec::new(),
            pixels_per_point: 1.0,
            due: None,
            was_over: false,
        }
    }

    /// The device is another from here on.
    pub(super) fn forget_device(&mut self) {
        self.painter = None;
    }

    /// Whether a key that is pressed is text for a field.
    fn takes_keys(&self) -> bool {
        self.state.egui_ctx().egui_wants_keyboard_input()
    }

    /// Hears an event before anything else does.
    pub(super) fn hear(&mut self, event: &WindowEvent) -> Heard {
        // Of a frame it knows itself, and so does the window of its size.
        if matches!(event, WindowEvent::RedrawRequested) {
            return Heard::default();
        }
        let takes_keys = self.takes_keys();
        let is_key = matches!(event, WindowEvent::KeyboardInput { .. });
        if is_key && !takes_keys {
            return Heard::default();
        }
        let response = self.state.on_window_event(&self.window, event);
        let is_over = self.state.egui_ctx().is_pointer_over_egui();
        let is_near = is_over || std::mem::replace(&mut self.was_over, is_over);
        let is_pointer = matches!(
            event,
            WindowEvent::CursorMoved { .. } | WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. }
        );
        // Whatever was held is let go everywhere.
        let is_end = match event {
            WindowEvent::MouseInput { state, .. } => !state.is_pressed(),
            WindowEvent::KeyboardInput { event, .. } => !event.state.is_pressed(),
            _ => false,
        };
        Heard {
            is_taken: (response.consumed || is_key) && !is_end,
            is_stale: response.repaint && (takes_keys || is_near || !is_pointer),
        }
    }

    /// Runs once: what `show` puts into the window is what is drawn next.
    pub(super) fn run(&mut self, show: impl FnMut(&mut Ui)) {
        let input = self.state.take_egui_input(&self.window);
        let context = self.state.egui_ctx().clone();
        let mut output = context.run_ui(input, show);
        self.state.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|viewport| viewport.repaint_delay);
        self.due = delay.and_then(|delay| Instant::now().checked_add(delay));
        self.pixels_per_point = output.pixels_per_point;
        self.jobs = context.tessellate(std::mem::take(&mut output.shapes), self.pixels_per_point);
        for (id, deltas) in std::mem::take(&mut output.textures_delta.set) {
            for delta in deltas {
                self.keep(id, &delta);
                self.changed.push((id, delta));
            }
        }
        self.gone.extend(std::mem::take(&mut output.textures_delta.free));
    }

    fn keep(&mut self, id: TextureId, delta: &ImageDelta) {
        let ImageData::Color(part) = &delta.image;
        match delta.pos {
            None => {
                self.images.insert(id, (ColorImage::clone(part), delta.options));
            }
            Some([left, top]) => {
                let Some((image, _)) = self.images.get_mut(&id) else { return };
                let width = part.size[0];
                for (row, pixels) in part.pixels.chunks_exact(width.max(1)).enumerate() {
                    let start = (top + row) * image.size[0] + left;
                    if let Some(place) = image.pixels.get_mut(start..start + width) {
                        place.copy_from_slice(pixels);
                    }
                }
            }
        }
    }

    /// Draws what the last run put into the window over a picture of so many pixels.
    pub(super) fn paint(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (picture, format): (&wgpu::TextureView, wgpu::TextureFormat),
        size: [u32; 2],
    ) {
        let Gpu { device, queue, .. } = gpu;
        let is_same = self.painter.as_ref().is_some_and(|painter| painter.format == format);
        if !is_same {
            // The textures are whole in the images.
            self.changed.clear();
            let whole = |(id, (image, options)): (&TextureId, &(ColorImage, TextureOptions))| {
                (*id, ImageDelta::full(image.clone(), *options))
            };
            self.changed.extend(self.images.iter().map(whole));
            self.painter = None;
        }
        let painter = self.painter.get_or_insert_with(|| Painter {
            renderer: Renderer::new(device, format, RendererOptions::default()),
            format,
        });
        for (id, delta) in self.changed.drain(..) {
            painter.renderer.update_texture(device, queue, id, &delta);
        }
        let screen = ScreenDescriptor { size_in_pixels: size, pixels_per_point: self.pixels_per_point };
        // There are no callbacks that would have commands of their own.
        painter.renderer.update_buffers(device, queue, encoder, &self.jobs, &screen);
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let attachment =
            wgpu::RenderPassColorAttachment { view: picture, depth_slice: None, resolve_target: None, ops };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("panels"),
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        painter.renderer.render(&mut pass.forget_lifetime(), &self.jobs, &screen);
        for id in self.gone.drain(..) {
            self.images.remove(&id);
            painter.renderer.free_texture(&id);
        }
    }

    /// In how long it wants to run again without an event; nothing where it does not.
    pub(super) fn due_in(&self, now: Instant) -> Option<Duration> {
        self.due.map(|due| due.saturating_duration_since(now))
    }
}
