//! What draws over a picture that is there already: a pass, the picture's depth for shaders, and what
//! pipelines draw into. Nothing here is for Vastex.

use super::headless::{self, Headless, Targets};

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

/// A target of colour whose picture shows through what is drawn over it.
pub(crate) fn over(colour: wgpu::TextureFormat) -> Targets {
    let blend = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
    (wgpu::ColorTargetState { blend, ..colour.into() }, None)
}

/// Targets of colour and of depth in which what is drawn takes the place of what is there, however near that
/// is.
pub(crate) fn instead([colour, depth]: [wgpu::TextureFormat; 2]) -> Targets {
    (colour.into(), Some(headless::depth_state(depth, wgpu::CompareFunction::Always)))
}
