//! Draws volumes: the picture, and the feedback pass that goes with it.

mod parts;
mod pipelines;
mod still;

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use vastex::{Error, Kinds, LayerId, Member, RAY_ANSWERS, Sampled, Textures, shader_module};

use super::camera::{RayUniform, VolumeView};
use super::channel::{ChannelUniform, MOST_CHANNELS, VolumeChannel};
use super::desc::{VolumeDesc, VolumeMode};
use super::labels::{LabelBinding, LabelsOnGpu};
use super::text::{LabelsInText, told_in, volume_text};
use crate::gpu::Gpu;
use crate::layers::PaletteUniform;
use crate::stage::{StageScene, Target, Uniform};
use pipelines::{Pipelines, Purpose};
pub use still::{StillStep, VolumeStill};

/// What a volume is seen through.
#[derive(Debug)]
pub struct VolumeCameraBinding {
    uniform: Uniform,
    labels: Option<LabelBinding>,
    view: u32,
    /// True if it sees a slice: views of one volume may see slices and all of it in one frame.
    is_slice: AtomicBool,
    /// Bricks that one of its rays meets.
    bricks: AtomicU32,
    /// Whether it sees what it saw when it was placed before.
    rests: AtomicBool,
    /// What it saw when it was last placed, and by which number of what is drawn.
    last: Mutex<Option<(VolumeView, [u32; 2], u64)>>,
}

impl VolumeCameraBinding {
    fn new(uniform: Uniform, labels: Option<LabelBinding>, view: u32) -> VolumeCameraBinding {
        let (is_slice, bricks, rests, last) = Default::default();
        VolumeCameraBinding { uniform, labels, view, is_slice, bricks, rests, last }
    }

    /// Takes note of what it sees, by a number of what is drawn; returns true if the view is that of before.
    fn see(&self, view: VolumeView, picture: [u32; 2], drawn: u64) -> bool {
        self.is_slice.store(view.is_slice(), Ordering::Relaxed);
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let before = last.replace((view, picture, drawn));
        self.rests.store(before == Some((view, picture, drawn)), Ordering::Relaxed);
        before.is_some_and(|(of, size, _)| (of, size) == (view, picture))
    }
}

/// `VolumeScene` of volume.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SceneUniform {
    rays: RayUniform,
    /// And one that is never shown, behind the others.
    channels: [ChannelUniform; MOST_CHANNELS + 1],
    maps: [PaletteUniform; MOST_CHANNELS],
}

/// A volume, ready to be drawn.
#[derive(Debug)]
pub struct VolumeRenderer {
    gpu: Gpu,
    desc: VolumeDesc,
    /// A number that changes with it.
    drawn: u64,
    /// By which channels are asked for: the layer of the one, or the group of all; or the labels alone.
    of_channels: Sampled,
    /// What the text was made for.
    kinds: Kinds,
    /// Whose bind group has the labels, too.
    bound: Sampled,
    labels: Option<LabelsOnGpu>,
    /// What the buffers are from which its shaders are told.
    told_in: wgpu::BufferUsages,
    /// Voxels along a side of a brick.
    brick: u32,
    format: wgpu::TextureFormat,
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    camera_layout: wgpu::BindGroupLayout,
    camera: VolumeCameraBinding,
    /// Shared by renderers that draw by one text.
    pipelines: Arc<Pipelines>,
}

/// Modes, and slices.
const MODES: usize = VolumeMode::ALL.len() + 1;

impl VolumeRenderer {
    /// Prepares a volume for pictures of `format`. Several channels become a group of `textures`. Fails where
    /// a texture was removed, where there are more channels than [`MOST_CHANNELS`], or neither channels nor
    /// labels, and where textures of channels do not share a pool, or are of other sizes or levels.
    pub fn new(
        gpu: &Gpu,
        textures: &mut Textures,
        desc: VolumeDesc,
        format: wgpu::TextureFormat,
    ) -> Result<VolumeRenderer, VolumeError> {
        let (sampled, bound, kinds) = bound(textures, &desc)?;
        let brick = brick_of(textures, &desc)?;
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
            drawn: 0,
            of_channels: sampled,
            kinds,
            format,
            module,
            layout,
            brick,
            camera: VolumeCameraBinding::new(uniform, labels.as_ref().map(|labels| labels.camera(gpu)), 0),
            bound,
            labels,
            told_in,
            camera_layout,
            pipelines: Arc::default(),
        })
    }

    /// What is drawn.
    pub fn desc(&self) -> &VolumeDesc {
        &self.desc
    }

    /// What the renderer's shaders sample, and so whose bind group they are given: the layer of the one
    /// channel, the group of all, or that of a channel and labels.
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
        VolumeCameraBinding::new(uniform, labels, view)
    }

    /// What becomes of samples, how far apart they are, how channels are shown: all that needs no other
    /// shaders. The channels stay as many, of the same layers, and so do labels and the list of their
    /// colours.
    pub fn set(&mut self, desc: VolumeDesc) {
        let layers = |desc: &VolumeDesc| desc.channels.iter().map(|c| c.layer).collect::<Vec<LayerId>>();
        debug_assert_eq!((layers(&desc), desc.is_exact), (layers(&self.desc), self.desc.is_exact));
        let labels = |desc: &VolumeDesc| desc.labels.as_ref().map(|l| (l.layer, l.colors.clone()));
        debug_assert_eq!(labels(&desc), labels(&self.desc));
        self.drawn += u64::from(self.desc != desc);
        self.desc = desc;
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
    // A text of one channel finds the others where they are bound alike: one pool, one layer of it. Rays go
    // through all channels as the bricks of the first one lie.
    let refused = match textures.kinds(group)?.binds_like(&kinds) {
        false => Some(VolumeError::Apart),
        true => (!are_alike(textures, channels)?).then_some(VolumeError::Unlike),
    };
    match refused {
        None => Ok((group.into(), kinds)),
        Some(error) => {
            textures.remove(group);
            Err(error)
        }
    }
}

/// Returns true if channels have one size and the same levels.
fn are_alike(textures: &Textures, channels: &[VolumeChannel]) -> Result<bool, Error> {
    let shape = |channel: &VolumeChannel| {
        textures.texture(channel.layer.texture()).map(|texture| &texture.description().geometry)
    };
    let shapes = channels.iter().map(shape).collect::<Result<Vec<_>, _>>()?;
    Ok(shapes.windows(2).all(|two| two[0] == two[1]))
}

/// The smallest side of a brick of what is drawn.
fn brick_of(textures: &Textures, desc: &VolumeDesc) -> Result<u32, Error> {
    let labels = desc.labels.as_ref().map(|labels| labels.layer);
    let mut smallest = u32::MAX;
    for layer in desc.channels.iter().map(|channel| channel.layer).chain(labels) {
        smallest = smallest.min(textures.texture(layer.texture())?.description().geometry.page()[0]);
    }
    Ok(smallest)
}

/// Why a volume cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// There are none, or too many.
    #[error("{0} channels: a picture of a volume shows 1 to {MOST_CHANNELS}; choose some")]
    Channels(usize),
    /// The channels' textures have other formats, brick sizes or layers.
    #[error(
        "the channels do not lie in one pool; show channels of one format and one size of bricks together"
    )]
    Apart,
    /// The channels' textures have other sizes or levels.
    #[error("the channels are not of one size and the same levels; show channels of one volume together")]
    Unlike,
    /// What the textures say.
    #[error(transparent)]
    Textures(#[from] Error),
}

impl VolumeRenderer {
    /// Moves a camera to a pose, for a picture of so many pixels whose samples lie at this share of their
    /// parts of a ray, where they jitter.
    fn place_at(
        &self,
        camera: &VolumeCameraBinding,
        (queue, textures): (&wgpu::Queue, &Textures),
        (pose, picture): (&VolumeView, [u32; 2]),
        share: f32,
    ) {
        let VolumeDesc { of, channels, labels, step, density, iso, .. } = &self.desc;
        let is_still = camera.see(*pose, picture, self.drawn);
        let bricks = match pose.is_slice() {
            // One, or two with labels: so its gaps are found in as few passes as those of rays.
            true => RAY_ANSWERS,
            false => self.desc.bricks_of_a_ray(pose, self.brick, picture),
        };
        // What few rays meet is asked for when the camera rests.
        let bricks = if is_still { bricks } else { bricks.min(RAY_ANSWERS) };
        camera.bricks.store(bricks, Ordering::Relaxed);
        let of_pose = pose.rays(of, picture);
        let mut rays = RayUniform::new(of, &of_pose, picture);
        // R of docs/volumes.md.
        rays.density = (density * 100.0 / of.extent().max_element()) as f32;
        (rays.step, rays.iso, rays.view, rays.share) = (*step as f32, *iso, camera.view, share);
        let shown = channels.iter().take(MOST_CHANNELS);
        let ids = textures.bindings().ids(self.of_channels).unwrap_or_default();
        rays.wants = ids.first().copied().unwrap_or_default();
        if !pose.is_slice() {
            rays.clip(of, &self.desc.clip);
        }
        if let (Some(labels), Some(binding)) = (labels, &camera.labels) {
            let id = textures.shader_id(labels.layer.texture()).unwrap_or_default();
            binding.set(queue, &labels.uniform(id, of.voxel, &of_pose, rays.anchor));
        }
        let mut told = SceneUniform { rays, channels: Zeroable::zeroed(), maps: Zeroable::zeroed() };
        // Where there are no channels, what is asked where levels are.
        told.channels[0].id = rays.wants;
        // Of a group the first id is that of all together.
        let of_channels = if ids.len() > 1 { &ids[1..] } else { &ids[..] };
        for (nth, (channel, id)) in shown.zip(of_channels).enumerate() {
            told.channels[nth] = channel.uniform(*id);
            if let Some(map) = channel.map {
                told.maps[nth] = map.uniform();
            }
        }
        camera.uniform.set(queue, &told);
    }
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
        self.place_at(camera, (queue, textures), (pose, picture), 0.5);
    }

    fn bricks_of_a_ray(&self, camera: &VolumeCameraBinding) -> u32 {
        camera.bricks.load(Ordering::Relaxed)
    }

    fn rests(&self, camera: &VolumeCameraBinding) -> bool {
        camera.rests.load(Ordering::Relaxed)
    }

    fn draw_wanted(
        &self,
        camera: &VolumeCameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
    ) {
        self.draw(camera, pass, textures, Purpose::Wanted);
    }

    fn draw_picture(
        &self,
        camera: &VolumeCameraBinding,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        let mut pass = target.begin(encoder, glam::Vec4::W);
        self.draw(camera, &mut pass, textures, Purpose::Picture);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layers::Palette;

    #[test]
    fn what_shaders_are_told_is_laid_out_alike() {
        // Without Vastex's text: the structs alone.
        let text = include_str!("wgsl/volume.wgsl");
        let structs = &text[text.find("struct VolumeChannel").unwrap()..text.find("@group(1)").unwrap()];
        let text =
            format!("{}{structs}\n@group(0) @binding(0) var<uniform> scene: VolumeScene;", Palette::wgsl());
        let module = naga::front::wgsl::parse_str(&text).unwrap();
        let size = |name: &str| {
            let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
            match &ty.inner {
                naga::TypeInner::Struct { members, span } => (members.len(), *span as usize),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(size("VolumeChannel"), (8, size_of::<ChannelUniform>()));
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
