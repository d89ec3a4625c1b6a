//! What a camera that rests sees better and better: the mean of many pictures, each of which samples
//! elsewhere along its rays.
//!
//! Their light is added up in one target of half floats, whose alpha counts them. A half float has 11 bits; a
//! sum of 16 pictures is rounded 15 times, each time by half of its last bit at most, so it is off by less
//! than 1/480 of itself: a quarter of a code of 255 where it is brightest. A mean that is made anew with each
//! picture would be rounded as often, and need a weight for each; sums in 32 bits are no colour target that
//! blends everywhere, in browsers least of all, and two targets that take turns are four times the memory.

use std::ops::Range;

use vastex::{Textures, shader_module};

use super::pipelines::{LIGHT, Purpose};
use super::{VolumeCameraBinding, VolumeRenderer};
use crate::gpu::Gpu;
use crate::stage::{DEPTH_FORMAT, Target, takes_light};
use crate::volume::text::mean_text;
use crate::volume::{VolumeDesc, VolumeMode, VolumeView};

/// Pictures of which a mean is worth looking at: those of fewer show the noise of each.
const FEWEST: u32 = 4;

/// The mean of the pictures of a camera that rests. Takes 8 bytes a pixel.
#[derive(Debug)]
pub struct VolumeStill {
    size: [u32; 2],
    view: wgpu::TextureView,
    group: wgpu::BindGroup,
    /// What the pictures are of.
    of: Option<(VolumeDesc, VolumeView, u64)>,
    /// How many are in the sum, and up to which row the next one.
    passes: u32,
    row: u32,
}

impl VolumeStill {
    /// Width and height of the pictures in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Of how many whole pictures it is the mean.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The rows that come next, at most so many.
    fn next_rows(&self, most: u32) -> Range<u32> {
        self.row..self.row.saturating_add(most.max(1)).min(self.size[1])
    }
}

/// What became of a mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StillStep {
    /// The mean is of all pictures, and nothing was drawn.
    Rests,
    /// Rows were drawn, and there is nothing new to be seen.
    Goes,
    /// A picture more is in it, and it is to be shown ([`VolumeRenderer::draw_mean`]).
    Shows,
}

impl VolumeRenderer {
    /// Returns true if several pictures of a view make a better one, as [`VolumeDesc::passes`] wants: in the
    /// modes whose samples add up, on devices that blend half floats. A maximum, a minimum and a surface are
    /// of one picture, whose samples lie where they always do, and so are slices.
    pub fn is_better_still(&self, view: &VolumeView) -> bool {
        let adds_up = matches!(self.desc.mode, VolumeMode::Average | VolumeMode::Emission);
        adds_up
            && self.desc.passes > 1
            && !view.is_slice()
            && !self.desc.channels.is_empty()
            && blends(&self.gpu)
    }

    /// A mean of pictures of so many pixels, of none at first.
    pub fn new_still(&self, size: [u32; 2]) -> VolumeStill {
        let device = &self.gpu.device;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("light of a volume"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: LIGHT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("light of a volume"),
            layout: &self.mean_pipeline().get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        VolumeStill { size, view, group, of: None, passes: 0, row: 0 }
    }

    /// Goes on with the mean of what a camera of its own sees from a pose: records the next `rows` rows, at
    /// most, of the next picture. Begins anew where anything else is seen than before: from another place,
    /// shown otherwise, or of other bricks, for which `content` is a number that changes with them.
    pub fn go_on(
        &self,
        still: &mut VolumeStill,
        encoder: &mut wgpu::CommandEncoder,
        (camera, textures): (&VolumeCameraBinding, &Textures),
        (pose, content): (&VolumeView, u64),
        rows: u32,
    ) -> StillStep {
        if still.of.as_ref().is_none_or(|of| (&of.0, &of.1, of.2) != (&self.desc, pose, content)) {
            (still.of, still.passes, still.row) = (Some((self.desc.clone(), *pose, content)), 0, 0);
        }
        let Ok(group) = textures.bind_group(self.bound) else { return StillStep::Rests };
        if still.passes >= self.desc.passes || !self.is_better_still(pose) {
            return StillStep::Rests;
        }
        let share = shared(still.passes);
        self.place_at(camera, (&self.gpu.queue, textures), (pose, still.size), share);
        let rows = still.next_rows(rows);
        let is_first = (still.passes, rows.start) == (0, 0);
        let load = if is_first { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("light of a volume"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &still.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_scissor_rect(0, rows.start, still.size[0], rows.end - rows.start);
        self.draw(camera, &mut pass, group, Purpose::Added);
        drop(pass);
        still.row = rows.end;
        if still.row < still.size[1] {
            return StillStep::Goes;
        }
        (still.passes, still.row) = (still.passes + 1, 0);
        let is_worth_it = still.passes >= FEWEST && still.passes.is_power_of_two();
        match is_worth_it || still.passes >= self.desc.passes {
            true => StillStep::Shows,
            false => StillStep::Goes,
        }
    }

    /// Records what shows a mean in a target of its size, in the format that the renderer draws.
    pub fn draw_mean(&self, still: &VolumeStill, encoder: &mut wgpu::CommandEncoder, target: &Target<'_>) {
        let mut pass = target.begin(encoder, glam::Vec4::W);
        pass.set_pipeline(self.mean_pipeline());
        pass.set_bind_group(0, &still.group, &[]);
        pass.draw(0..3, 0..1);
    }

    fn mean_pipeline(&self) -> &wgpu::RenderPipeline {
        self.pipelines.mean.get_or_init(|| mean_pipeline(&self.gpu.device, self.format))
    }
}

/// Where the samples of the `nth` picture lie in their parts of a ray, before a pixel adds its own: of the
/// first 2, 4, 8 and so on evenly far apart.
fn shared(nth: u32) -> f32 {
    (f64::from(nth.reverse_bits()) / 2.0f64.powi(32)) as f32
}

/// Returns true if a device adds in half floats.
fn blends(gpu: &Gpu) -> bool {
    let features = gpu.adapter.get_texture_format_features(LIGHT);
    features.flags.contains(wgpu::TextureFormatFeatureFlags::BLENDABLE)
        && features.allowed_usages.contains(wgpu::TextureUsages::RENDER_ATTACHMENT)
}

fn mean_pipeline(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = shader_module(device, Some("mean"), mean_text());
    let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("mean"),
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
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("mean"),
        bind_group_layouts: &[Some(&group)],
        immediate_size: 0,
    });
    let constants = [("MEAN_ENCODES", f64::from(u8::from(!takes_light(format))))];
    let compilation_options =
        wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("mean"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("mean_fill"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("mean"),
            compilation_options,
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_evenly_far_apart_after_any_power_of_two() {
        for bits in 0..=4 {
            let count = 1u32 << bits;
            let mut shares: Vec<f32> = (0..count).map(shared).collect();
            shares.sort_by(f32::total_cmp);
            let even: Vec<f32> = (0..count).map(|nth| nth as f32 / count as f32).collect();
            assert_eq!(shares, even);
        }
    }
}
