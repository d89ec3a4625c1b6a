//! What draws over a picture that is there already: a pass, the picture's depth for shaders, and a pipeline
//! for one rectangle. Nothing here is for Vastex.

use super::headless::Headless;

/// A pass that draws over the picture, by the depth of which shaders may go ([`depth_group`]).
pub(crate) fn begin_over<'e>(
    target: &Headless,
    encoder: &'e mut wgpu::CommandEncoder,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("over the picture"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &target.colour.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    })
}

/// The depth of the picture for shaders to read.
pub(crate) fn depth_group(target: &Headless) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let layout = target.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("depth"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Depth,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }],
    });
    let view = target.depth.create_view(&Default::default());
    let group = target.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("depth"),
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
    });
    (layout, group)
}

/// A pipeline for one rectangle over all of a target of colour, which is blended over what is there, or where
/// there is a target of depth, too, takes its place.
pub(crate) fn pipeline_over(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    [place, shade]: [&str; 2],
    (colour, depth): (wgpu::TextureFormat, Option<wgpu::TextureFormat>),
) -> wgpu::RenderPipeline {
    let blend = depth.is_none().then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shade),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(place),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: depth.map(|format| wgpu::DepthStencilState {
            format,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(shade),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: colour,
                blend,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
