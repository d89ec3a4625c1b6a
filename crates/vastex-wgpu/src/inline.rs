//! Feedback from the main pass: where its pixels report what they want, and how that becomes the pixels of a
//! feedback target.
//!
//! What a pixel reports is the shader's business (report.wgsl), how the result comes back that of
//! [`Readback`](crate::Readback).

use vastex_core::shader_constants;

use crate::device::{alive, compute_pipelines, dispatch_size, whole_buffer};
use crate::error::GpuError;
use crate::feedback::{FeedbackScale, FeedbackView};
use crate::raw::{FEEDBACK_FORMAT, RawTexture};
use crate::shader;
use crate::views::Views;

/// How what is reported becomes feedback on a device, whatever the target.
#[derive(Clone, Debug)]
pub struct InlinePipelines {
    layout: wgpu::BindGroupLayout,
    forget: wgpu::ComputePipeline,
    settle: wgpu::ComputePipeline,
}

impl InlinePipelines {
    /// Compiles the shader, on a device that has [`FeedbackMode::Inline`](crate::FeedbackMode::Inline).
    pub fn new(device: &wgpu::Device) -> InlinePipelines {
        let bindings = [
            whole_buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::WriteOnly,
                format: FEEDBACK_FORMAT,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
        ];
        let text = shader::inline_wgsl();
        let (layout, [forget, settle]) =
            compute_pipelines(device, "vastex inline", text, &bindings, ["forget", "settle"]);
        InlinePipelines { layout, forget, settle }
    }
}

/// Where the main pass of a view reports which pages it wants.
///
/// 160 bytes for each cell of 8x8 pixels: two and a half for each pixel of the picture.
#[derive(Debug)]
pub struct InlineTarget {
    picture: [u32; 2],
    /// The number of the view.
    view: u32,
    raw: RawTexture,
    /// Made for the cells as they lay in this buffer.
    bound: Option<(wgpu::Buffer, wgpu::BindGroup)>,
    pipelines: InlinePipelines,
}

impl InlineTarget {
    /// A target for pictures of so many pixels of the view of this number, which gets cells for it; see
    /// [`Views::is_moved`].
    pub fn new(
        device: &wgpu::Device,
        pipelines: &InlinePipelines,
        views: &mut Views,
        view: u32,
        picture: [u32; 2],
    ) -> Result<InlineTarget, GpuError> {
        alive(device)?;
        let size = FeedbackView::new(picture, FeedbackScale::Reduced, 0).target_size();
        let raw = RawTexture::new(device, size, wgpu::TextureUsages::STORAGE_BINDING)?;
        views.fit_cells(device, view, size)?;
        Ok(InlineTarget { picture, view, raw, bound: None, pipelines: pipelines.clone() })
    }

    /// The bind group of the view's cells, which those of another view may have moved.
    fn bind(&mut self, device: &wgpu::Device, views: &Views) {
        let (Some(buffer), Some(cells)) = (views.cells(), views.cells_of(self.view)) else { return };
        if self.bound.as_ref().is_some_and(|(bound, _)| bound == buffer) {
            return;
        }
        let resources =
            [wgpu::BindingResource::Buffer(cells), wgpu::BindingResource::TextureView(self.raw.view())];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vastex inline"),
            layout: &self.pipelines.layout,
            entries: &entries,
        });
        self.bound = Some((buffer.clone(), bind_group));
    }

    /// Before the main pass of a frame: forgets what was reported and says which pixels are asked, of all
    /// that is recorded between here and [`InlineTarget::end`]. `reversed_depth` is true where nearer is a
    /// larger depth. Writes 4 bytes for each cell.
    pub fn begin(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        views: &Views,
        frame: u64,
        reversed_depth: bool,
    ) {
        self.bind(device, views);
        let frame_view = FeedbackView::new(self.picture, FeedbackScale::Reduced, frame);
        views.set(device, encoder, self.view, &frame_view.inline_params(reversed_depth));
        self.run(encoder, &self.pipelines.forget);
    }

    /// Records what follows the main pass: makes pixels of what was reported, of each cell the nearest.
    pub fn end(&self, encoder: &mut wgpu::CommandEncoder) {
        self.run(encoder, &self.pipelines.settle);
    }

    /// One invocation for each cell.
    fn run(&self, encoder: &mut wgpu::CommandEncoder, pipeline: &wgpu::ComputePipeline) {
        let [columns, rows] = self.raw.size();
        let [x, y] = dispatch_size((columns * rows).div_ceil(shader_constants::WORKGROUP));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("vastex inline"),
            timestamp_writes: None,
        });
        let Some((_, bind_group)) = &self.bound else { return };
        pass.set_bind_group(0, bind_group, &[]);
        pass.set_pipeline(pipeline);
        pass.dispatch_workgroups(x, y, 1);
    }

    /// Size of the picture that it is for, in pixels.
    pub fn picture(&self) -> [u32; 2] {
        self.picture
    }

    /// What was reported, to be read back: a pixel for each cell.
    pub fn raw(&self) -> &RawTexture {
        &self.raw
    }
}
