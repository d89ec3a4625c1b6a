//! A target of linear light in half floats, and the pass that encodes it into the 8 bits that are shown.
//!
//! What is blended is blended as light there, whatever the formats of the layers are and of the picture. One
//! opaque layer has nothing to blend and is drawn straight into the picture ([`TargetKind::Direct`]), which
//! is faster.

/// What scenes are drawn into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TargetKind {
    /// The picture itself.
    Direct,
    /// A target of linear light, which is encoded into the picture at the end of the frame.
    Linear,
}

impl TargetKind {
    /// The faster way that is right for so many layers: a single one has nothing to be blended with. Direct
    /// wherever the adapter does not blend into half floats.
    pub fn for_layers(adapter: &wgpu::Adapter, layers: usize) -> TargetKind {
        let features = adapter.get_texture_format_features(LinearTarget::FORMAT);
        let is_blended = features.flags.contains(wgpu::TextureFormatFeatureFlags::BLENDABLE);
        let is_drawn = features.allowed_usages.contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
        if layers > 1 && is_drawn && is_blended { TargetKind::Linear } else { TargetKind::Direct }
    }

    /// The format that scenes are drawn in for pictures of a format.
    pub fn drawn_format(self, picture: wgpu::TextureFormat) -> wgpu::TextureFormat {
        match self {
            TargetKind::Direct => picture,
            TargetKind::Linear => LinearTarget::FORMAT,
        }
    }
}

/// Returns true if light is drawn into a target of this format: half floats hold it and sRGB formats encode
/// it. Other formats store display values as they are.
pub fn takes_light(format: wgpu::TextureFormat) -> bool {
    format.is_srgb() || format == LinearTarget::FORMAT
}

/// A target of linear light, of the size of the picture that it is encoded into.
#[derive(Debug)]
pub struct LinearTarget {
    view: wgpu::TextureView,
    group: wgpu::BindGroup,
    pipeline: wgpu::RenderPipeline,
}

impl LinearTarget {
    /// The format of the target.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

    /// For pictures of `size` pixels and of the format `picture`. Takes 8 bytes a pixel.
    pub fn new(device: &wgpu::Device, size: [u32; 2], picture: wgpu::TextureFormat) -> LinearTarget {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("light"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: LinearTarget::FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let layout = layout(device);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("light"),
            layout: &layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        LinearTarget { view, group, pipeline: pipeline(device, &layout, picture) }
    }

    /// What scenes are drawn into.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Records the pass that encodes the light into every pixel of a picture.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::TextureView) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("encode"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: picture,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The text of the pass that encodes.
pub fn encode_text() -> String {
    [include_str!("wgsl/encode.wgsl"), include_str!("wgsl/display.wgsl")].join("\n")
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("light"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }],
    })
}

fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    picture: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let module = vastex::shader_module(device, Some("encode"), encode_text());
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("encode"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let constants = [("ENCODE_IN_SHADER", f64::from(u8::from(!takes_light(picture))))];
    let compilation_options =
        wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("encode"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("encode_fill"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("encode"),
            compilation_options,
            targets: &[Some(picture.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
