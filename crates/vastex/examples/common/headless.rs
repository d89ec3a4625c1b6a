//! What an application has instead of a window: a device, a picture in memory, a file; and a pipeline for
//! rectangles. Nothing here is for Vastex, but for the features that the device is asked for.

use std::path::Path;

use anyhow::Context as _;
use glam::Vec4;

pub(crate) const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

pub(crate) struct Headless {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) colour: wgpu::Texture,
    pub(crate) depth: wgpu::Texture,
}

impl Headless {
    pub(crate) fn new([width, height]: [u32; 2]) -> anyhow::Result<Headless> {
        let described = wgpu::InstanceDescriptor::new_without_display_handle();
        let instance = pollster::block_on(vastex::instance_for(described));
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: vastex::required_features(&adapter),
            required_limits: wgpu::Limits::default(), // WebGPU's
            ..Default::default()
        }))?;
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let colour = texture(PICTURE_FORMAT, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH_FORMAT, wgpu::TextureUsages::TEXTURE_BINDING);
        Ok(Headless { device, queue, colour, depth })
    }

    /// The pass that draws the picture.
    pub(crate) fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder, sky: Vec4) -> wgpu::RenderPass<'e> {
        let [r, g, b, a] = sky.as_dvec4().to_array();
        let clear =
            |colour| wgpu::Operations { load: wgpu::LoadOp::Clear(colour), store: wgpu::StoreOp::Store };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.colour.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: clear(wgpu::Color { r, g, b, a }),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth.create_view(&Default::default()),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }

    /// The picture, 4 bytes a pixel, row by row. Waits for the GPU.
    pub(crate) fn read(&self) -> anyhow::Result<Vec<u8>> {
        let line = self.colour.width() * 4;
        let row = line.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row * self.colour.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            self.colour.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            self.colour.size(),
        );
        self.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        let rows = buffer.get_mapped_range(..)?;
        Ok(rows.chunks(row as usize).flat_map(|row| &row[..line as usize]).copied().collect())
    }
}

/// A uniform buffer of so many bytes, and the bind group through which shaders see it.
pub(crate) fn uniform(
    device: &wgpu::Device,
    size: u64,
) -> (wgpu::Buffer, wgpu::BindGroupLayout, wgpu::BindGroup) {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camera"),
        size,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("camera"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("camera"),
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    });
    (buffer, layout, group)
}

/// What a pipeline draws into: a target of colour, and perhaps one of depth.
pub(crate) type Targets = (wgpu::ColorTargetState, Option<wgpu::DepthStencilState>);

/// Targets of two formats, of colour and of depth, in which the nearest is seen.
pub(crate) fn nearest([colour, depth]: [wgpu::TextureFormat; 2]) -> Targets {
    (colour.into(), Some(depth_state(depth, wgpu::CompareFunction::Less)))
}

/// A target of depth: what `compare` lets pass is drawn, and its depth is kept where it was compared.
pub(crate) fn depth_state(
    format: wgpu::TextureFormat,
    compare: wgpu::CompareFunction,
) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format,
        depth_write_enabled: Some(compare != wgpu::CompareFunction::Always),
        depth_compare: Some(compare),
        stencil: Default::default(),
        bias: Default::default(),
    }
}

/// A pipeline for rectangles of two triangles by two entry points of a module.
pub(crate) fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    [place, shade]: [&str; 2],
    (colour, depth): Targets,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shade),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(place),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: depth,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(shade),
            compilation_options: Default::default(),
            targets: &[Some(colour)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Writes a picture of 4 bytes a pixel.
pub(crate) fn write_png(path: &Path, [width, height]: [u32; 2], pixels: &[u8]) -> anyhow::Result<()> {
    let file = std::fs::File::create(path).with_context(|| path.display().to_string())?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(())
}
