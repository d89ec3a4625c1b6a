//! The pipelines of scenes: what they have in common, and what differs between them.
//!
//! Which are made, and what is drawn by them, is `renderer`'s business and that of whoever draws other
//! things.

use super::fixed_relief::PatchStart;
use super::mesh::Vertex;
use super::patches::Patch;
use crate::stage::DEPTH_FORMAT;

/// What the vertex stage is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Corners {
    /// Points of a surface.
    Vertices,
    /// Points of a closed surface, which is seen from outside: its far side is hidden, and would be shaded
    /// for nothing where a fragment shader that writes something keeps depth from being tested before it.
    Outside,
    /// Patches, whose points are numbered.
    Patches,
    /// Patches in fixed point, whose points are numbered.
    FixedPatches,
    /// Nothing: what is drawn fills the picture.
    None,
}

impl Corners {
    /// How one lies in its buffer.
    fn layout(self) -> Option<wgpu::VertexBufferLayout<'static>> {
        const VERTEX: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x2];
        const PATCH: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x4];
        const PATCH_START: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Sint32x4];
        let (stride, step_mode, attributes): (usize, _, &[wgpu::VertexAttribute]) = match self {
            Corners::Vertices | Corners::Outside => {
                (size_of::<Vertex>(), wgpu::VertexStepMode::Vertex, &VERTEX)
            }
            Corners::Patches => (size_of::<Patch>(), wgpu::VertexStepMode::Instance, &PATCH),
            Corners::FixedPatches => (size_of::<PatchStart>(), wgpu::VertexStepMode::Instance, &PATCH_START),
            Corners::None => return None,
        };
        Some(wgpu::VertexBufferLayout { array_stride: stride as u64, step_mode, attributes })
    }

    /// Which triangles are not drawn.
    fn hidden(self) -> Option<wgpu::Face> {
        matches!(self, Corners::Outside).then_some(wgpu::Face::Back)
    }
}

/// How a pipeline draws over what is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Drawing {
    /// The nearest surface stays.
    Nearest,
    /// Every pixel is drawn, whatever is there.
    Everywhere,
    /// All surfaces are blended, from both sides.
    Blended(wgpu::BlendState),
}

/// What differs between the pipelines of a scene.
pub struct PipelineParts<'a> {
    /// The shaders.
    pub module: &'a wgpu::ShaderModule,
    /// What the module's overridable constants are.
    pub constants: &'a [(&'static str, f64)],
    /// What the vertex stage is given.
    pub corners: Corners,
    /// The entry points of the vertex and of the fragment stage.
    pub entries: [&'a str; 2],
    /// Of the targets.
    pub formats: &'a [wgpu::TextureFormat],
}

impl PipelineParts<'_> {
    /// A pipeline of which the nearest surface stays.
    pub fn pipeline(
        self,
        device: &wgpu::Device,
        groups: &[Option<&wgpu::BindGroupLayout>],
    ) -> wgpu::RenderPipeline {
        self.drawing(device, groups, Drawing::Nearest)
    }

    /// A pipeline that draws in any way.
    pub(super) fn drawing(
        self,
        device: &wgpu::Device,
        groups: &[Option<&wgpu::BindGroupLayout>],
        drawing: Drawing,
    ) -> wgpu::RenderPipeline {
        let (depth_stencil, blend, cull_mode) = match drawing {
            Drawing::Nearest => (Some(nearest()), None, self.corners.hidden()),
            Drawing::Everywhere => (Some(no_depth_test()), None, None),
            Drawing::Blended(blend) => (None, Some(blend), None),
        };
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("scene"),
            bind_group_layouts: groups,
            immediate_size: 0,
        });
        let compilation_options =
            wgpu::PipelineCompilationOptions { constants: self.constants, ..Default::default() };
        let target = |&format| wgpu::ColorTargetState { blend, ..wgpu::TextureFormat::into(format) };
        let targets: Vec<_> = self.formats.iter().map(|format| Some(target(format))).collect();
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("scene"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.entries[0]),
                compilation_options: compilation_options.clone(),
                buffers: &self.corners.layout().map_or(Vec::new(), |corners| vec![Some(corners)]),
            },
            primitive: wgpu::PrimitiveState { cull_mode, ..Default::default() },
            depth_stencil,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(self.entries[1]),
                compilation_options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// The nearest surface stays.
fn nearest() -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Less),
        stencil: Default::default(),
        bias: Default::default(),
    }
}

/// Draws on every pixel, whatever is there.
fn no_depth_test() -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(false),
        depth_compare: Some(wgpu::CompareFunction::Always),
        stencil: Default::default(),
        bias: Default::default(),
    }
}
