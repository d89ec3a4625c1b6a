//! The wall: a grid of panels, each with a texture of its own, drawn by one pipeline.

use std::sync::Arc;

use anyhow::Result;
use vastex::{Geometry, GeometrySpec, Pace, Settings, TextureId, Textures};
use vastex_scenes::Gpu;
use vastex_tiles::PropertySource;

use crate::clock::Clock;

/// Pixels of the picture.
const PICTURE: [u32; 2] = [1280, 720];
/// Texels of each texture.
const SIZE: [u32; 2] = [8192, 4096];
/// Texels of level 0 on a pixel.
const DENSITY: f32 = 1.3;
/// Texels that every texture moves along per frame.
const SPEED: f32 = 12.0;

struct Panel {
    texture: TextureId,
    /// Left, top, right and bottom in clip space.
    place: [f32; 4],
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// A grid of panels, each with a texture of its own.
pub(crate) struct Wall {
    gpu: Gpu,
    pub(crate) textures: Textures,
    panels: Vec<Panel>,
    wanted: wgpu::RenderPipeline,
}

/// Seconds of a frame.
pub(crate) struct Times {
    pub(crate) feedback: f64,
    pub(crate) update: f64,
}

impl Wall {
    pub(crate) fn new(gpu: &Gpu, count: usize) -> Result<Wall> {
        let device = &gpu.device;
        let pace = Pace::LockStep { latency_frames: 1 };
        let settings = Settings {
            pace,
            picture: PICTURE,
            upload_bytes_per_frame: 4 << 20,
            in_flight_bytes: 64 << 20,
            ..Settings::default()
        };
        let mut textures = Textures::new(device, &gpu.queue, settings)?;
        let layout = uniform_layout(device);
        let geometry = Geometry::new(GeometrySpec::image(SIZE[0], SIZE[1]))?;
        let columns = (count as f32).sqrt().ceil();
        let rows = (count as f32 / columns).ceil();
        let mut panels = Vec::new();
        for nth in 0..count {
            let texture = textures.add_blocking(Arc::new(PropertySource::new(geometry.clone())))?;
            let (column, row) = ((nth as f32) % columns, (nth as f32 / columns).floor());
            let x = |column: f32| 2.0 * column / columns - 1.0;
            let y = |row: f32| 1.0 - 2.0 * row / rows;
            let place = [x(column), y(row), x(column + 1.0), y(row + 1.0)];
            let uniform = device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 48,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
            });
            let id = textures.shader_id(texture)?;
            gpu.queue.write_buffer(&uniform, 32, bytemuck::bytes_of(&[id; 4]));
            panels.push(Panel { texture, place, uniform, group });
        }
        let first = panels.first().map(|panel| panel.texture);
        let wanted = pipeline(device, &textures, first, &layout)?;
        Ok(Wall { gpu: gpu.clone(), textures, panels, wanted })
    }

    /// One frame but for the picture, each texture moved along to `at`; says what the loop took.
    pub(crate) fn frame(&mut self, at: u32, clock: &mut Clock) -> Result<Times> {
        for panel in &self.panels {
            let [left, top, right, bottom] = panel.place;
            let [width, height] =
                [(right - left) / 2.0 * PICTURE[0] as f32, (top - bottom) / 2.0 * PICTURE[1] as f32];
            let begin = [(600.0 + SPEED * at as f32) / SIZE[0] as f32, 0.3];
            let across = [width * DENSITY / SIZE[0] as f32, height * DENSITY / SIZE[1] as f32];
            let uniform = [panel.place, [begin[0], begin[1], across[0], across[1]]];
            self.gpu.queue.write_buffer(&panel.uniform, 0, bytemuck::bytes_of(&uniform));
        }
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (panels, wanted) = (&self.panels, &self.wanted);
        clock.lap();
        self.textures.feedback(&mut encoder, PICTURE, |pass, groups| {
            draw(pass, wanted, panels, |texture| groups.get(texture));
        })?;
        let feedback = clock.lap();
        self.textures.update()?;
        let update = clock.lap();
        self.gpu.queue.submit([encoder.finish()]);
        while self.textures.poll_event().is_some() {}
        Ok(Times { feedback, update })
    }
}

fn draw<'g>(
    pass: &mut wgpu::RenderPass<'_>,
    pipeline: &wgpu::RenderPipeline,
    panels: &[Panel],
    group: impl Fn(TextureId) -> Option<&'g wgpu::BindGroup>,
) {
    pass.set_pipeline(pipeline);
    // The textures lie in one pool, and so have one bind group.
    if let Some(first) = panels.first() {
        pass.set_bind_group(0, group(first.texture), &[]);
    }
    for panel in panels {
        pass.set_bind_group(1, &panel.group, &[]);
        pass.draw(0..4, 0..1);
    }
}

fn uniform_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    })
}

/// For the feedback pass. The textures are alike, so what suits the first suits all.
fn pipeline(
    device: &wgpu::Device,
    textures: &Textures,
    first: Option<TextureId>,
    panel: &wgpu::BindGroupLayout,
) -> Result<wgpu::RenderPipeline> {
    let first = first.ok_or_else(|| anyhow::anyhow!("a wall without textures"))?;
    let kinds = textures.kinds(first)?;
    let module =
        vastex::shader_module(device, None, include_str!("wall.wgsl").to_owned() + &textures.wgsl(&kinds));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&textures.bind_group_layout(&kinds)), Some(panel)],
        immediate_size: 0,
    });
    Ok(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("place_feedback"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Textures::FEEDBACK_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("want"),
            compilation_options: Default::default(),
            targets: &[Some(Textures::FEEDBACK_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    }))
}
