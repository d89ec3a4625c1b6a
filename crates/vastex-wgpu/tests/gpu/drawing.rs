//! Draws with a shader of a test's own into two small targets, of colours and of feedback, and reads them.

use vastex_wgpu::FEEDBACK_FORMAT;
use vastex_wgpu::test_device::TestDevice;

use crate::common::read;
use crate::test_text::TestText;

/// Pixels per side of the targets.
pub(crate) const SIDE: u32 = 64;

/// What is drawn.
pub(crate) struct Drawing<'a> {
    /// All of the shader.
    pub(crate) text: TestText,
    /// Its entry points.
    pub(crate) entries: [&'static str; 2],
    pub(crate) topology: wgpu::PrimitiveTopology,
    pub(crate) vertices: u32,
    /// Of the virtual texture, group 0.
    pub(crate) layout: &'a wgpu::BindGroupLayout,
    pub(crate) group: &'a wgpu::BindGroup,
    /// A storage buffer that the vertex stage reads, group 1.
    pub(crate) inputs: Option<&'a wgpu::Buffer>,
}

/// The pixels of both targets, row by row.
pub(crate) fn drawn(gpu: &TestDevice, drawing: &Drawing<'_>) -> (Vec<[f32; 4]>, Vec<[u32; 4]>) {
    let device = &gpu.device;
    let inputs_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: true },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    });
    let formats = [wgpu::TextureFormat::Rgba32Float, FEEDBACK_FORMAT];
    let pipeline = pipeline(gpu, drawing, &inputs_layout, formats);
    let targets = formats.map(|format| target(gpu, format));
    let views = targets.each_ref().map(|target| target.create_view(&Default::default()));
    let attachments = views.each_ref().map(|view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })
    });
    let inputs = drawing.inputs.map(|inputs| {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &inputs_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: inputs.as_entire_binding() }],
        })
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &attachments,
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, drawing.group, &[]);
    if let Some(inputs) = &inputs {
        pass.set_bind_group(1, inputs, &[]);
    }
    pass.draw(0..drawing.vertices, 0..1);
    drop(pass);
    let buffers = targets.each_ref().map(|target| {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(SIDE * SIDE * 16),
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(SIDE * 16), rows_per_image: None };
        let into = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(target.as_image_copy(), into, target.size());
        buffer
    });
    gpu.queue.submit([encoder.finish()]);
    (read(gpu, &buffers[0]), read(gpu, &buffers[1]))
}

fn pipeline(
    gpu: &TestDevice,
    drawing: &Drawing<'_>,
    inputs: &wgpu::BindGroupLayout,
    formats: [wgpu::TextureFormat; 2],
) -> wgpu::RenderPipeline {
    let module = drawing.text.module(&gpu.device);
    let layouts = [Some(drawing.layout), Some(inputs)];
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &layouts[..1 + usize::from(drawing.inputs.is_some())],
        immediate_size: 0,
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(drawing.entries[0]),
            compilation_options: drawing.text.options(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { topology: drawing.topology, ..Default::default() },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(drawing.entries[1]),
            compilation_options: drawing.text.options(),
            targets: &formats.map(|format| Some(format.into())),
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn target(gpu: &TestDevice, format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}
