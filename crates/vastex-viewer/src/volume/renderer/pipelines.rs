//! The pipelines of a volume, made when they are first needed, and what a pass draws with one.

use std::sync::OnceLock;
use std::sync::atomic::Ordering;

use vastex::Textures;

use super::{MODES, VolumeCameraBinding, VolumeRenderer};
use crate::stage::{DEPTH_FORMAT, LinearTarget, takes_light};
use crate::volume::VolumeMode;

/// The format of the sum of several pictures.
pub(super) const LIGHT: wgpu::TextureFormat = LinearTarget::FORMAT;

/// Adds all four of its channels.
const ADDED: wgpu::BlendState = {
    let component = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: component, alpha: component }
};

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Feedback.
    Wanted,
    /// The picture.
    Picture,
    /// The light of one that is added to those before it, its samples elsewhere.
    Added,
}

/// By the number of a mode, slices last.
#[derive(Debug, Default)]
pub(super) struct Pipelines {
    wanted: [OnceLock<wgpu::RenderPipeline>; MODES],
    picture: [OnceLock<wgpu::RenderPipeline>; MODES],
    added: [OnceLock<wgpu::RenderPipeline>; MODES],
    /// What shows the mean.
    pub(super) mean: OnceLock<wgpu::RenderPipeline>,
}

impl VolumeRenderer {
    /// The number of what a camera sees.
    fn mode(&self, camera: &VolumeCameraBinding) -> usize {
        match camera.is_slice.load(Ordering::Relaxed) {
            true => MODES - 1,
            false => VolumeMode::ALL.iter().position(|mode| *mode == self.desc.mode).unwrap_or(0),
        }
    }

    fn pipeline(&self, mode: usize, purpose: Purpose) -> wgpu::RenderPipeline {
        let encodes = !takes_light(self.format) && purpose == Purpose::Picture;
        let constants = [
            ("VOLUME_MODE", mode as f64),
            ("VOLUME_EXACT", f64::from(u8::from(self.desc.is_exact))),
            ("VOLUME_ENCODES", f64::from(u8::from(encodes))),
            ("VOLUME_JITTERS", f64::from(u8::from(purpose == Purpose::Added))),
        ];
        // A module knows what its entry points need, of either stage; feedback encodes nothing.
        let constants = if purpose == Purpose::Wanted { &constants[..2] } else { &constants[..] };
        let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        let (vertex, fragment) = match purpose {
            Purpose::Wanted => ("volume_fill_wanted", "volume_want"),
            Purpose::Picture | Purpose::Added => ("volume_fill", "volume_picture"),
        };
        let target: wgpu::ColorTargetState = match purpose {
            Purpose::Wanted => Textures::FEEDBACK_FORMAT.into(),
            Purpose::Picture => self.format.into(),
            Purpose::Added => wgpu::ColorTargetState { blend: Some(ADDED), ..LIGHT.into() },
        };
        let depth = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        };
        self.gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("volume"),
            layout: Some(&self.layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some(vertex),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: Default::default(),
            // What is added up has no depth.
            depth_stencil: Some(depth).filter(|_| purpose != Purpose::Added),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some(fragment),
                compilation_options,
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    pub(super) fn draw(
        &self,
        camera: &VolumeCameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
        purpose: Purpose,
    ) {
        let mode = self.mode(camera);
        let pipelines = match purpose {
            Purpose::Wanted => &self.pipelines.wanted,
            Purpose::Picture => &self.pipelines.picture,
            Purpose::Added => &self.pipelines.added,
        };
        pass.set_pipeline(pipelines[mode].get_or_init(|| self.pipeline(mode, purpose)));
        pass.set_bind_group(0, textures, &[]);
        pass.set_bind_group(1, &camera.uniform.group, &[]);
        if let Some(labels) = &camera.labels {
            pass.set_bind_group(2, &labels.group, &[]);
        }
        pass.draw(0..3, 0..1);
    }
}
