//! What the renderer is made of: layouts, buffers, targets, pipelines. Plain wgpu, as any renderer has it.

use super::chess::{Object, Vertex};
use super::common::headless::{DEPTH_FORMAT, Headless};

/// Bytes from one object to the next in the buffer of all: WebGPU's least alignment.
pub(crate) const OBJECT_STRIDE: u32 = 256;

/// What of a pipeline differs.
pub(crate) struct Drawing<'a> {
    pub(crate) vertex: &'a str,
    /// With the format of what it draws into; `None` if depth alone is drawn.
    pub(crate) fragment: Option<(&'a str, wgpu::TextureFormat)>,
    pub(crate) depth: wgpu::TextureFormat,
    pub(crate) compare: wgpu::CompareFunction,
    pub(crate) samples: u32,
    /// True if depth is moved away from the light.
    pub(crate) is_biased: bool,
}

impl<'a> Drawing<'a> {
    /// Of depth alone.
    pub(crate) fn depth_of(vertex: &'a str, samples: u32) -> Drawing<'a> {
        let compare = wgpu::CompareFunction::Always;
        Drawing { vertex, fragment: None, depth: DEPTH_FORMAT, compare, samples, is_biased: false }
    }
}

pub(crate) fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    drawing: &Drawing<'_>,
) -> wgpu::RenderPipeline {
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2],
    };
    let targets = drawing.fragment.map(|(_, format)| Some(format.into()));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(drawing.vertex),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(drawing.vertex),
            compilation_options: Default::default(),
            buffers: &[Some(vertices)],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: drawing.depth,
            depth_write_enabled: Some(drawing.compare != wgpu::CompareFunction::Equal),
            depth_compare: Some(drawing.compare),
            stencil: Default::default(),
            bias: match drawing.is_biased {
                true => wgpu::DepthBiasState { constant: 2, slope_scale: 2.0, clamp: 0.0 },
                false => Default::default(),
            },
        }),
        multisample: wgpu::MultisampleState { count: drawing.samples, ..Default::default() },
        fragment: drawing.fragment.map(|(entry_point, _)| wgpu::FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            targets: targets.as_slice(),
        }),
        multiview_mask: None,
        cache: None,
    })
}

pub(crate) fn pipeline_layout(
    device: &wgpu::Device,
    groups: [Option<&wgpu::BindGroupLayout>; 4],
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("scene"),
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

pub(crate) fn group_layout(
    device: &wgpu::Device,
    label: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
}

/// What each of the groups begins with.
pub(crate) fn uniform_entry(has_dynamic_offset: bool) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Uniform;
    layout_entry(0, wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None })
}

/// The light and its shadow map.
pub(crate) fn shadow_entries() -> [wgpu::BindGroupLayoutEntry; 3] {
    let map = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Depth,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
    [uniform_entry(false), layout_entry(1, map), layout_entry(2, sampler)]
}

pub(crate) fn layout_entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::VERTEX_FRAGMENT, ty, count: None }
}

pub(crate) fn buffer(target: &Headless, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
    let buffer = target.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("scene"),
        size: bytes.len() as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    target.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// Where each object stands.
pub(crate) fn objects_buffer(target: &Headless, objects: &[Object]) -> wgpu::Buffer {
    let mut bytes = vec![0; objects.len() * OBJECT_STRIDE as usize];
    for (object, bytes) in objects.iter().zip(bytes.chunks_mut(OBJECT_STRIDE as usize)) {
        bytes[..64].copy_from_slice(bytemuck::bytes_of(&object.world_from_object.to_cols_array()));
    }
    buffer(target, wgpu::BufferUsages::UNIFORM, &bytes)
}

/// A target of a pass.
pub(crate) fn target_view(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    sample_count: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("target"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
