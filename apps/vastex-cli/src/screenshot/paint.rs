//! What lies over a picture, painted by egui without a window.

use anyhow::{Result, anyhow};
use egui::epaint::{ClippedPrimitive, Primitive};
use egui::{Context, Pos2, RawInput, Rect, TextureId, Ui, Vec2, ViewportId};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use vastex_scenes::{Gpu, Picture};
use vastex_viewer::stage::TextureRead;

use crate::parts::Part;

/// The format of what is painted.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Frames after which everything has found its size and has faded in, and the seconds between two.
const FRAMES: u32 = 4;
const STEP: f64 = 0.5;

/// egui over a picture of so many pixels.
pub(super) struct OverPainter<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    size: [u32; 2],
    pixels_per_point: f32,
    jobs: Vec<ClippedPrimitive>,
}

impl<'a> OverPainter<'a> {
    pub(super) fn new(gpu: &'a Gpu, size: [u32; 2], pixels_per_point: f32) -> OverPainter<'a> {
        let renderer = Renderer::new(&gpu.device, FORMAT, RendererOptions::default());
        OverPainter { gpu, renderer, size, pixels_per_point, jobs: Vec::new() }
    }

    /// Makes a picture known, so that it can be shown.
    pub(super) fn register(&mut self, view: &wgpu::TextureView) -> TextureId {
        self.renderer.register_native_texture(&self.gpu.device, view, wgpu::FilterMode::Linear)
    }

    /// Runs egui as often as it takes until what `show` shows stays.
    pub(super) fn run(&mut self, mut show: impl FnMut(&mut Ui)) {
        let Gpu { device, queue, .. } = self.gpu;
        let context = Context::default();
        let [width, height] = self.size.map(|side| side as f32 / self.pixels_per_point);
        for frame in 0..FRAMES {
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(width, height)));
            let time = Some(f64::from(frame) * STEP);
            let mut input = RawInput { screen_rect, time, ..RawInput::default() };
            let viewport = input.viewports.entry(ViewportId::ROOT).or_default();
            viewport.native_pixels_per_point = Some(self.pixels_per_point);
            let mut output = context.run_ui(input, &mut show);
            for (id, deltas) in std::mem::take(&mut output.textures_delta.set) {
                deltas.iter().for_each(|delta| self.renderer.update_texture(device, queue, id, delta));
            }
            // What is freed may be of shapes that are painted in the end.
            output.textures_delta.clear();
            self.jobs = context.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
        }
    }

    /// Paints what the last run showed over a row of parts, part by part.
    pub(super) fn paint(&mut self, parts: &[Part], row: &mut Picture) -> Result<()> {
        for part in parts {
            let painted = self.paint_part(part, &part.of(row))?;
            part.put(&painted, row);
        }
        Ok(())
    }

    fn paint_part(&mut self, part: &Part, picture: &Picture) -> Result<Picture> {
        let Gpu { device, queue, .. } = self.gpu;
        let [width, height] = part.size;
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("screenshot"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 4), rows_per_image: None };
        queue.write_texture(texture.as_image_copy(), &picture.rgba, layout, size);
        let by = Vec2::new(part.at[0] as f32, part.at[1] as f32) / self.pixels_per_point;
        let jobs: Vec<ClippedPrimitive> = self.jobs.iter().map(|job| moved(job, -by)).collect();
        let screen = ScreenDescriptor { size_in_pixels: part.size, pixels_per_point: self.pixels_per_point };
        let mut encoder = device.create_command_encoder(&Default::default());
        self.renderer.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let view = texture.create_view(&Default::default());
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let attachment =
            wgpu::RenderPassColorAttachment { view: &view, depth_slice: None, resolve_target: None, ops };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("screenshot"),
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        let read = TextureRead::submit(self.gpu, encoder, &texture, 4);
        loop {
            device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|error| anyhow!("the graphics device does not answer: {error}"))?;
            if let Some(bytes) = read.take() {
                return Ok(Picture { size: part.size, rgba: bytes? });
            }
        }
    }
}

/// What is painted, elsewhere.
fn moved(job: &ClippedPrimitive, by: Vec2) -> ClippedPrimitive {
    let mut moved = job.clone();
    moved.clip_rect = moved.clip_rect.translate(by);
    if let Primitive::Mesh(mesh) = &mut moved.primitive {
        mesh.translate(by);
    }
    moved
}
