//! Draws volumes: the picture, and the feedback pass that goes with it.

mod parts;

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use bytemuck::{Pod, Zeroable};
use vastex::{Error, Kinds, LayerId, Member, Sampled, Textures, shader_module};

use super::camera::{RayUniform, VolumeBox, VolumeClip, VolumeView};
use super::channel::{ChannelUniform, MOST_CHANNELS, VolumeChannel};
use super::labels::{LabelBinding, LabelsOnGpu, VolumeLabels};
use super::text::{LabelsInText, told_in, volume_text};
use crate::gpu::Gpu;
use crate::stage::{DEPTH_FORMAT, StageScene, Target, Uniform, takes_light};

/// What becomes of the samples along a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VolumeMode {
    /// The largest.
    #[default]
    Mip,
    /// The smallest.
    Minip,
    /// Their mean.
    Average,
    /// All of them glow and hide what is behind.
    Emission,
    /// The surface at which a value is reached.
    Iso,
}

impl VolumeMode {
    /// Every mode.
    pub const ALL: [VolumeMode; 5] =
        [VolumeMode::Mip, VolumeMode::Minip, VolumeMode::Average, VolumeMode::Emission, VolumeMode::Iso];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            VolumeMode::Mip => "mip",
            VolumeMode::Minip => "minip",
            VolumeMode::Average => "average",
            VolumeMode::Emission => "emission",
            VolumeMode::Iso => "iso",
        }
    }
}

/// What is drawn of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeDesc {
    /// Its box.
    pub of: VolumeBox,
    /// The channels that are shown: 1 to [`MOST_CHANNELS`], of textures of one geometry and one format; none
    /// where there are labels alone.
    pub channels: Vec<VolumeChannel>,
    /// The labels that are shown over them.
    pub labels: Option<VolumeLabels>,
    /// What becomes of samples along a ray; slices have none.
    pub mode: VolumeMode,
    /// How far samples along a ray are apart, in sides of a voxel of the level that is wanted: 1, 1/3 and 1/5
    /// have samples in the middles of voxels where rays go along an axis.
    pub step: f64,
    /// How dense a volume is in emission: 1 where a ray of a hundredth of the longest side of the box passes
    /// 1 - opacity.
    pub density: f64,
    /// The value at which a surface is, as shaders sample it.
    pub iso: f32,
    /// Whether samples are blended by the shader in single precision, and not by the device's filter.
    pub is_exact: bool,
    /// What is left of it for rays.
    pub clip: VolumeClip,
}

impl VolumeDesc {
    /// Channels of a volume by [`VolumeMode::Mip`].
    pub fn new(of: VolumeBox, channels: Vec<VolumeChannel>) -> VolumeDesc {
        let mode = VolumeMode::default();
        let (labels, clip) = (None, VolumeClip::default());
        VolumeDesc { of, channels, labels, mode, step: 1.0, density: 1.0, iso: 0.5, is_exact: false, clip }
    }

    /// The bricks of `brick` voxels a side that one ray of a picture meets, about, and at most: 1 to 64. A
    /// ray asks for one of them in a frame, and every pixel of the feedback has asked for all after as many
    /// jitter cycles ([`vastex::JITTER_CYCLE`]). Who wants a last picture waits for so long while nothing
    /// new is loaded: bricks that few rays meet come into the working set and leave it, so that
    /// [`vastex::diagnostics::FrameStats::converged`] may never be true.
    pub fn bricks_of_a_ray(&self, view: &VolumeView, brick: u32, picture: [u32; 2]) -> u64 {
        let sides = self.of.size.map(f64::from);
        // Where pixels are larger than voxels a coarser level is seen.
        let pixels = f64::from(picture[0].max(picture[1]).max(1));
        let coarser = (sides.into_iter().fold(1.0, f64::max) / pixels).max(1.0);
        let along = |axis: usize| (sides[axis] / coarser / f64::from(brick.max(1))).ceil() + 1.0;
        let bricks: f64 = match view {
            VolumeView::Slice { .. } | VolumeView::Plane(_) => 1.0,
            VolumeView::Face(face) => {
                let [_, _, forward] = face.axes();
                (0..3).filter(|axis| forward[*axis] != 0.0).map(along).sum()
            }
            VolumeView::Around(_) => (0..3).map(along).sum(),
        };
        // What is asked for of labels is asked for in turn with that of the image.
        let of_labels = if self.labels.is_some() { 2.0 } else { 1.0 };
        (bricks * of_labels).clamp(1.0, 64.0) as u64
    }
}

/// What a volume is seen through.
#[derive(Debug)]
pub struct VolumeCameraBinding {
    uniform: Uniform,
    labels: Option<LabelBinding>,
    view: u32,
    /// Whether it sees a slice: views of one volume may see slices and all of it in one frame.
    is_slice: AtomicBool,
}

/// `VolumeScene` of volume.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SceneUniform {
    rays: RayUniform,
    channels: [ChannelUniform; MOST_CHANNELS],
}

/// A volume, ready to be drawn.
#[derive(Debug)]
pub struct VolumeRenderer {
    gpu: Gpu,
    desc: VolumeDesc,
    /// By which channels are asked for: the layer of the one, or the group of all; or the labels alone.
    of_channels: Sampled,
    /// What the text was made for.
    kinds: Kinds,
    /// Whose bind group has the labels, too.
    bound: Sampled,
    labels: Option<LabelsOnGpu>,
    /// What the buffers are from which its shaders are told.
    told_in: wgpu::BufferUsages,
    format: wgpu::TextureFormat,
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    camera_layout: wgpu::BindGroupLayout,
    camera: VolumeCameraBinding,
    /// By the number of a mode, slices last: those of the picture, and those of feedback.
    picture: [OnceLock<wgpu::RenderPipeline>; MODES],
    wanted: [OnceLock<wgpu::RenderPipeline>; MODES],
}

/// Modes, and slices.
const MODES: usize = VolumeMode::ALL.len() + 1;

impl VolumeRenderer {
    /// Prepares a volume for pictures of `format`. Several channels become a group of `textures`. Fails where
    /// a texture was removed, where there are more channels than [`MOST_CHANNELS`], or neither channels nor
    /// labels, and where textures of channels do not share a pool.
    pub fn new(
        gpu: &Gpu,
        textures: &mut Textures,
        desc: VolumeDesc,
        format: wgpu::TextureFormat,
    ) -> Result<VolumeRenderer, VolumeError> {
        let (sampled, bound, kinds) = bound(textures, &desc)?;
        let device = &gpu.device;
        let in_text = match (&desc.labels, desc.channels.is_empty()) {
            (None, _) => LabelsInText::None,
            (Some(_), false) => LabelsInText::Over,
            (Some(_), true) => LabelsInText::Alone,
        };
        let text = volume_text(&textures.wgsl(&kinds), in_text, kinds.mode());
        let module = shader_module(device, Some("volume"), text);
        let told_in = told_in(in_text, kinds.mode());
        let camera_layout = Uniform::layout_in(device, told_in);
        let labels = desc.labels.as_ref().map(|labels| LabelsOnGpu::new(gpu, labels, told_in));
        let of_textures = textures.bind_group_layout(&kinds);
        let mut layouts = vec![Some(&of_textures), Some(&camera_layout)];
        layouts.extend(labels.as_ref().map(|labels| Some(labels.layout())));
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("volume"),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let uniform = Uniform::new_in::<SceneUniform>(device, &camera_layout, told_in);
        Ok(VolumeRenderer {
            gpu: gpu.clone(),
            desc,
            of_channels: sampled,
            kinds,
            format,
            module,
            layout,
            camera: VolumeCameraBinding {
                uniform,
                labels: labels.as_ref().map(|labels| labels.camera(gpu)),
                view: 0,
                is_slice: AtomicBool::new(false),
            },
            bound,
            labels,
            told_in,
            camera_layout,
            picture: Default::default(),
            wanted: Default::default(),
        })
    }

    /// What is drawn.
    pub fn desc(&self) -> &VolumeDesc {
        &self.desc
    }

    /// What its shaders sample, and so whose bind group they are given: the layer of the one channel, the
    /// group of all, or that of a channel and labels.
    pub fn sampled(&self) -> Sampled {
        self.bound
    }

    /// What the volume is seen through.
    pub fn camera(&self) -> &VolumeCameraBinding {
        &self.camera
    }

    /// A camera to draw it through from another place in the same encoder, of the view with this number
    /// ([`vastex::ViewRef::number`]).
    pub fn new_camera(&self, view: u32) -> VolumeCameraBinding {
        let uniform = Uniform::new_in::<SceneUniform>(&self.gpu.device, &self.camera_layout, self.told_in);
        let labels = self.labels.as_ref().map(|labels| labels.camera(&self.gpu));
        VolumeCameraBinding { uniform, labels, view, is_slice: AtomicBool::new(false) }
    }

    /// What becomes of samples, how far apart they are, how channels are shown: all that needs no other
    /// shaders. The channels stay as many, of the same layers, and so do labels and the list of their
    /// colours.
    pub fn set(&mut self, desc: VolumeDesc) {
        let layers = |desc: &VolumeDesc| desc.channels.iter().map(|c| c.layer).collect::<Vec<LayerId>>();
        debug_assert_eq!((layers(&desc), desc.is_exact), (layers(&self.desc), self.desc.is_exact));
        let labels = |desc: &VolumeDesc| desc.labels.as_ref().map(|l| (l.layer, l.colors.clone()));
        debug_assert_eq!(labels(&desc), labels(&self.desc));
        self.desc = desc;
    }

    /// The number of what a camera sees.
    fn mode(&self, camera: &VolumeCameraBinding) -> usize {
        match camera.is_slice.load(Ordering::Relaxed) {
            true => MODES - 1,
            false => VolumeMode::ALL.iter().position(|mode| *mode == self.desc.mode).unwrap_or(0),
        }
    }

    fn pipeline(&self, mode: usize, is_wanted: bool) -> wgpu::RenderPipeline {
        let encodes = !takes_light(self.format);
        let constants = [
            ("VOLUME_MODE", mode as f64),
            ("VOLUME_EXACT", f64::from(u8::from(self.desc.is_exact))),
            ("VOLUME_ENCODES", f64::from(u8::from(encodes))),
        ];
        // A module knows what its entry points need, of either stage; feedback encodes nothing.
        let constants = if is_wanted { &constants[..2] } else { &constants[..] };
        let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        let (vertex, fragment, format) = match is_wanted {
            true => ("volume_fill_wanted", "volume_want", Textures::FEEDBACK_FORMAT),
            false => ("volume_fill", "volume_picture", self.format),
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
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some(fragment),
                compilation_options,
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    fn draw(
        &self,
        camera: &VolumeCameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
        is_wanted: bool,
    ) {
        let mode = self.mode(camera);
        let pipelines = if is_wanted { &self.wanted } else { &self.picture };
        pass.set_pipeline(pipelines[mode].get_or_init(|| self.pipeline(mode, is_wanted)));
        pass.set_bind_group(0, textures, &[]);
        pass.set_bind_group(1, &camera.uniform.group, &[]);
        if let Some(labels) = &camera.labels {
            pass.set_bind_group(2, &labels.group, &[]);
        }
        pass.draw(0..3, 0..1);
    }
}

/// What the channels are sampled by, whose bind group the shaders of all are given, and their kinds.
fn bound(textures: &mut Textures, desc: &VolumeDesc) -> Result<(Sampled, Sampled, Kinds), VolumeError> {
    let Some(labels) = &desc.labels else {
        let (sampled, kinds) = sampled(textures, &desc.channels)?;
        return Ok((sampled, sampled, kinds));
    };
    let label = Member::apart("label", labels.layer);
    let (sampled, members) = match desc.channels.first() {
        None => (labels.layer.into(), vec![label]),
        Some(first) => {
            let (sampled, _) = sampled(textures, &desc.channels)?;
            (sampled, vec![Member::new("image", first.layer), label])
        }
    };
    match textures.add_group(members) {
        Ok(group) => Ok((sampled, group.into(), textures.kinds(group)?)),
        Err(error) => {
            if let Sampled::Group(channels) = sampled {
                textures.remove(channels);
            }
            Err(error.into())
        }
    }
}

/// What the channels are sampled by together, and the kind of each.
fn sampled(textures: &mut Textures, channels: &[VolumeChannel]) -> Result<(Sampled, Kinds), VolumeError> {
    if !(1..=MOST_CHANNELS).contains(&channels.len()) {
        return Err(VolumeError::Channels(channels.len()));
    }
    let kinds = textures.kinds(channels[0].layer)?;
    if channels.len() == 1 {
        return Ok((channels[0].layer.into(), kinds));
    }
    let names = (0..).map(|nth: usize| format!("c{nth}"));
    let members = names.zip(channels).map(|(name, channel)| (name, channel.layer));
    let group = textures.add_group(members)?;
    // A text of one channel finds the others where they are bound alike: one pool, one layer of it.
    match textures.kinds(group)?.binds_like(&kinds) {
        true => Ok((group.into(), kinds)),
        false => {
            textures.remove(group);
            Err(VolumeError::Apart)
        }
    }
}

/// Why a volume cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// There are none, or too many.
    #[error("{0} channels: a picture of a volume shows 1 to {MOST_CHANNELS}; choose some")]
    Channels(usize),
    /// Their textures have other formats, brick sizes or layers.
    #[error(
        "the channels do not lie in one pool; show channels of one format and one size of bricks together"
    )]
    Apart,
    /// What the textures say.
    #[error(transparent)]
    Textures(#[from] Error),
}

impl StageScene for VolumeRenderer {
    type Pose = VolumeView;
    type Camera = VolumeCameraBinding;

    fn sampled(&self) -> Sampled {
        self.bound
    }

    fn place(
        &self,
        camera: &VolumeCameraBinding,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &VolumeView,
        picture: [u32; 2],
    ) {
        let VolumeDesc { of, channels, labels, step, density, iso, .. } = &self.desc;
        camera.is_slice.store(pose.is_slice(), Ordering::Relaxed);
        let of_pose = pose.rays(of, picture);
        let mut rays = RayUniform::new(of, &of_pose, picture);
        // R of docs/volumes.md.
        rays.density = (density * 100.0 / of.extent().max_element()) as f32;
        (rays.step, rays.iso, rays.view) = (*step as f32, *iso, camera.view);
        let shown = channels.iter().take(MOST_CHANNELS);
        rays.channels = shown.len() as u32;
        let ids = textures.bindings().ids(self.of_channels).unwrap_or_default();
        rays.wants = ids.first().copied().unwrap_or_default();
        if !pose.is_slice() {
            rays.clip(of, &self.desc.clip);
        }
        if let (Some(labels), Some(binding)) = (labels, &camera.labels) {
            let id = textures.shader_id(labels.layer.texture()).unwrap_or_default();
            binding.set(queue, &labels.uniform(id, of.voxel, &of_pose, rays.anchor));
        }
        let mut told = SceneUniform { rays, channels: Zeroable::zeroed() };
        // Where there are no channels, what is asked where levels are.
        told.channels[0].id = rays.wants;
        // Of a group the first id is that of all together.
        let of_channels = if ids.len() > 1 { &ids[1..] } else { &ids[..] };
        for ((told, channel), id) in told.channels.iter_mut().zip(shown).zip(of_channels) {
            *told = channel.uniform(*id);
        }
        camera.uniform.set(queue, &told);
    }

    fn draw_wanted(
        &self,
        camera: &VolumeCameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
    ) {
        self.draw(camera, pass, textures, true);
    }

    fn draw_picture(
        &self,
        camera: &VolumeCameraBinding,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        let mut pass = target.begin(encoder, glam::Vec4::W);
        self.draw(camera, &mut pass, textures, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shaders_are_told_is_laid_out_alike() {
        // Without Vastex's text: the structs alone.
        let text = include_str!("wgsl/volume.wgsl");
        let structs = &text[text.find("struct VolumeChannel").unwrap()..text.find("@group(1)").unwrap()];
        let text = format!("{structs}\n@group(0) @binding(0) var<uniform> scene: VolumeScene;");
        let module = naga::front::wgsl::parse_str(&text).unwrap();
        let size = |name: &str| {
            let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
            match &ty.inner {
                naga::TypeInner::Struct { members, span } => (members.len(), *span as usize),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(size("VolumeChannel"), (6, size_of::<ChannelUniform>()));
        assert_eq!(size("VolumeScene").1, size_of::<SceneUniform>());
        assert_eq!(std::mem::offset_of!(SceneUniform, channels), 11 * 16);
    }

    #[test]
    fn the_numbers_of_modes_are_those_of_the_shader() {
        let text = include_str!("wgsl/volume.wgsl");
        for (number, mode) in VolumeMode::ALL.iter().enumerate() {
            let name = mode.name().to_uppercase();
            assert!(text.contains(&format!("const VOLUME_{name}: u32 = {number}u;")), "{name}");
        }
        assert!(text.contains(&format!("const VOLUME_SLICE: u32 = {}u;", MODES - 1)));
    }
}
