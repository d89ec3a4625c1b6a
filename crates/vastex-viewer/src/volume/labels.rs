//! Labels over a volume: whole numbers of things, each in a colour of its own.
//!
//! They are drawn by the shader of the volume that they lie over, or by themselves; what a picture of them is
//! stands in docs/volumes.md. The shader's part is wgsl/labels.wgsl.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, UVec3};
use vastex::LayerId;

use super::camera::{VolumeBox, VolumeRays};
use crate::gpu::Gpu;
use crate::stage::Uniform;

/// Colours of a list that are taken at most, the first ones of more.
pub const MOST_LABEL_COLORS: usize = 1 << 20;
/// Entries of a row of the list in GPU memory.
const LIST_WIDTH: usize = 1024;

/// What others than the selected label look like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum OtherLabels {
    /// A quarter as opaque, so that the selected one shows through them.
    #[default]
    Dimmed,
    /// Not at all.
    Hidden,
}

impl OtherLabels {
    /// Both.
    pub const ALL: [OtherLabels; 2] = [OtherLabels::Dimmed, OtherLabels::Hidden];

    /// The rule's name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            OtherLabels::Dimmed => "dimmed",
            OtherLabels::Hidden => "hidden",
        }
    }

    /// The share of the opacity that they have.
    fn share(self) -> f32 {
        match self {
            OtherLabels::Dimmed => 0.25,
            OtherLabels::Hidden => 0.0,
        }
    }
}

/// The number of a label that somebody wrote, of up to 64 bits with or without a sign; 0 is none. Fails with
/// what is to be written.
pub fn parse_label(text: &str) -> Result<i128, &'static str> {
    let within = i128::from(i64::MIN)..=i128::from(u64::MAX);
    match text.trim().parse().ok().filter(|label| within.contains(label)) {
        Some(0) => Err("0 is where there is no label; write another whole number"),
        Some(label) => Ok(label),
        None => Err("write a whole number of up to 64 bits"),
    }
}

/// Labels, as they are shown: over the channels of a volume, or alone.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeLabels {
    /// The layer that holds the labels, one of whole numbers. 0 is nothing.
    pub layer: LayerId,
    /// The labels' box, in the units of the world of the volume; voxels may be of another size than those of
    /// the image.
    pub of: VolumeBox,
    /// Where the labels' box begins in the world of the volume.
    pub begin: [f64; 3],
    /// 0 to 1: how much a label hides of what lies under it.
    pub opacity: f32,
    /// True if slices show of each label only the voxels that have another one beside them in the plane.
    pub outlines: bool,
    /// The label that is shown in full, through all others.
    pub selected: Option<u64>,
    /// What the others look like then.
    pub others: OtherLabels,
    /// The colours of those that do not have the usual one.
    pub colors: Arc<LabelColors>,
}

impl VolumeLabels {
    /// Labels whose box is `of`, and begins where the volume's does: half opaque, none of them selected, in
    /// their usual colours.
    pub fn new(layer: impl Into<LayerId>, of: VolumeBox) -> VolumeLabels {
        VolumeLabels {
            layer: layer.into(),
            of,
            begin: [0.0; 3],
            opacity: 0.5,
            outlines: false,
            selected: None,
            others: OtherLabels::default(),
            colors: Arc::default(),
        }
    }

    /// How many turns of loops a ray takes for them at most ([`LabelColors::turns`]).
    pub fn turns(&self) -> LabelTurns {
        self.colors.turns(self.selected.map(|_| self.others))
    }

    /// What shaders are told, for rays in a volume with such voxels; `id` is that of their texture.
    pub(super) fn uniform(&self, id: u32, voxel: DVec3, rays: &VolumeRays, anchor: [u32; 3]) -> LabelUniform {
        let size = UVec3::from_array(self.of.size).as_dvec3();
        let [scale, shift, own] = place(&self.of, self.begin.into(), voxel, rays, anchor);
        let selected = self.selected.unwrap_or(0);
        LabelUniform {
            scale: scale.as_vec3().to_array(),
            opacity: self.opacity,
            shift: shift.as_vec3().to_array(),
            id,
            begin: (-own).as_vec3().to_array(),
            colors: self.colors.of.len() as u32,
            end: (size - own).as_vec3().to_array(),
            others: self.others.share(),
            anchor: own.as_uvec3().to_array(),
            outlines: self.outlines.into(),
            selected: halves(selected),
            hidden: self.colors.hidden.len() as u32,
            unused: 0,
        }
    }
}

/// How places of an image become those of labels whose box is `of` and begins at `begin`: what its offsets
/// from `anchor` are multiplied by, what is added then, and the voxel from which the result counts.
fn place(of: &VolumeBox, begin: DVec3, voxel: DVec3, rays: &VolumeRays, anchor: [u32; 3]) -> [DVec3; 3] {
    let last = (UVec3::from_array(of.size).as_dvec3() - 1.0).max(DVec3::ZERO);
    let own = ((rays.middle - begin) / of.voxel).floor().clamp(DVec3::ZERO, last);
    let scale = voxel / of.voxel;
    [scale, UVec3::from_array(anchor).as_dvec3() * scale - begin / of.voxel - own, own]
}

/// What a ray takes for labels at most, of which a software driver takes a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelTurns {
    /// Turns of loops for each voxel that it passes.
    pub per_voxel: u32,
    /// How often it is looked along: each time there is something for each brick, too.
    pub looks: u32,
}

/// Colours that somebody gave to labels: sRGB codes, and how opaque each is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LabelColors {
    of: Vec<(u64, [u8; 4])>,
    /// Labels whose colours are nothing.
    hidden: Vec<u64>,
}

impl LabelColors {
    /// Of these labels, of which the first [`MOST_LABEL_COLORS`] are taken; a label that comes twice has the
    /// first colour.
    pub fn new(colors: impl IntoIterator<Item = (u64, [u8; 4])>) -> LabelColors {
        let mut of: Vec<_> = colors.into_iter().take(MOST_LABEL_COLORS).collect();
        // Stable, so that the first of several stays.
        of.sort_by_key(|(label, _)| *label);
        of.dedup_by_key(|(label, _)| *label);
        // No voxel of label 0 is looked at twice, whatever its colour.
        let hidden = of.iter().filter(|(label, color)| *label != 0 && color[3] == 0);
        let hidden = hidden.map(|(label, _)| *label).collect();
        LabelColors { of, hidden }
    }

    /// How many turns of loops a ray takes at most for labels in these colours; where one of them is
    /// selected, what the others look like. A turn for each voxel, and one more for each halving of the list
    /// of those whose colours are nothing, if there are several; and a turn for the selected one alone, for
    /// which the ray is looked along before where it is seen through the others.
    pub fn turns(&self, others: Option<OtherLabels>) -> LabelTurns {
        // The only one is looked up once a ray: the next voxel of it is known to be hidden.
        let halvings = match self.hidden.len() {
            0 | 1 => 0,
            several => usize::BITS - several.leading_zeros(),
        };
        match others {
            None => LabelTurns { per_voxel: 1 + halvings, looks: 1 },
            // A selected one is found or hidden, and nothing else is looked for in the list.
            Some(OtherLabels::Hidden) => LabelTurns { per_voxel: 1, looks: 1 },
            Some(OtherLabels::Dimmed) => LabelTurns { per_voxel: 2 + halvings, looks: 2 },
        }
    }

    /// The colour of a label, and how opaque it is; 0 is nothing.
    pub fn of(&self, label: u64) -> [u8; 4] {
        if label == 0 {
            return [0; 4];
        }
        match self.of.binary_search_by_key(&label, |(label, _)| *label) {
            Ok(place) => self.of[place].1,
            Err(_) => {
                let [red, green, blue] = usual_color(label);
                [red, green, blue, 255]
            }
        }
    }

    /// The list in GPU memory.
    fn texture(&self, gpu: &Gpu) -> wgpu::Texture {
        let rows = (self.of.len() + self.hidden.len()).div_ceil(LIST_WIDTH).max(1);
        let mut words = vec![[0u32; 4]; rows * LIST_WIDTH];
        let hidden = self.hidden.iter().map(|label| (*label, [0; 4]));
        for (word, (label, color)) in words.iter_mut().zip(self.of.iter().copied().chain(hidden)) {
            let [low, high] = halves(label);
            *word = [low, high, u32::from_le_bytes(color), 0];
        }
        let size = wgpu::Extent3d { width: LIST_WIDTH as u32, height: rows as u32, depth_or_array_layers: 1 };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("colours of labels"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * LIST_WIDTH as u32),
            rows_per_image: Some(rows as u32),
        };
        gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&words), layout, size);
        texture
    }
}

/// The colour of a label that nobody gave one, as sRGB codes: a hue, a saturation and a brightness that
/// follow from all of its 64 bits, and from nothing else, so that it is the same in every picture.
pub fn usual_color(label: u64) -> [u8; 3] {
    let hash = mixed(mixed((label >> 32) as u32 ^ 0x9e37_79b9) ^ label as u32);
    let hue = ((hash & 0xffff) * 1536) >> 16;
    let saturation = 140 + ((((hash >> 16) & 0xff) * 115) >> 8);
    let value = 160 + (((hash >> 24) * 95) >> 8);
    let part = hue & 0xff;
    let low = value * (255 - saturation) / 255;
    let falling = value * (255 - saturation * part / 255) / 255;
    let rising = value * (255 - saturation * (255 - part) / 255) / 255;
    let codes = match hue >> 8 {
        0 => [value, rising, low],
        1 => [falling, value, low],
        2 => [low, value, rising],
        3 => [low, falling, value],
        4 => [rising, low, value],
        _ => [value, low, falling],
    };
    codes.map(|code| code as u8)
}

/// The lower half of a label and the upper one.
fn halves(label: u64) -> [u32; 2] {
    [label as u32, (label >> 32) as u32]
}

/// Spreads the bits of a word over all others.
fn mixed(mut word: u32) -> u32 {
    word = (word ^ (word >> 16)).wrapping_mul(0x7feb_352d);
    word = (word ^ (word >> 15)).wrapping_mul(0x846c_a68b);
    word ^ (word >> 16)
}

/// `VolumeLabels` of labels.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(super) struct LabelUniform {
    scale: [f32; 3],
    opacity: f32,
    shift: [f32; 3],
    id: u32,
    begin: [f32; 3],
    colors: u32,
    end: [f32; 3],
    others: f32,
    anchor: [u32; 3],
    outlines: u32,
    selected: [u32; 2],
    hidden: u32,
    unused: u32,
}

/// What passes bind of labels, beside their texture: the colours, and the layout.
#[derive(Debug)]
pub(super) struct LabelsOnGpu {
    layout: wgpu::BindGroupLayout,
    colors: wgpu::TextureView,
    /// What the buffer is from which shaders are told.
    told_in: wgpu::BufferUsages,
}

impl LabelsOnGpu {
    pub(super) fn new(gpu: &Gpu, labels: &VolumeLabels, told_in: wgpu::BufferUsages) -> LabelsOnGpu {
        let visibility = wgpu::ShaderStages::FRAGMENT;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let uniform = wgpu::BindingType::Buffer {
            ty: Uniform::binding_in(told_in),
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let list = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("labels"),
            entries: &[entry(0, uniform), entry(1, list)],
        });
        let colors = labels.colors.texture(gpu).create_view(&Default::default());
        LabelsOnGpu { layout, colors, told_in }
    }

    pub(super) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// What one camera binds.
    pub(super) fn camera(&self, gpu: &Gpu) -> LabelBinding {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("labels"),
            size: size_of::<LabelUniform>() as u64,
            usage: self.told_in | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("labels"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&self.colors),
                },
            ],
        });
        LabelBinding { buffer, group }
    }
}

/// What a camera binds of labels.
#[derive(Debug)]
pub(super) struct LabelBinding {
    buffer: wgpu::Buffer,
    pub(super) group: wgpu::BindGroup,
}

impl LabelBinding {
    pub(super) fn set(&self, queue: &wgpu::Queue, told: &LabelUniform) {
        queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(told));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{VolumeFace, VolumeView};

    #[test]
    fn what_shaders_are_told_is_laid_out_alike() {
        let text = include_str!("wgsl/labels.wgsl");
        let end = text.find("@group(2) @binding(1)").unwrap();
        let text = &text[text.find("struct VolumeLabels").unwrap()..end];
        let module = naga::front::wgsl::parse_str(text).unwrap();
        let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("VolumeLabels")).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{ty:?}") };
        let offset =
            |name: &str| members.iter().find(|m| m.name.as_deref() == Some(name)).map(|m| m.offset as usize);
        assert_eq!(*span as usize, size_of::<LabelUniform>());
        assert_eq!(offset("others"), Some(std::mem::offset_of!(LabelUniform, others)));
        assert_eq!(offset("outlines"), Some(std::mem::offset_of!(LabelUniform, outlines)));
        assert_eq!(offset("selected"), Some(std::mem::offset_of!(LabelUniform, selected)));
        assert_eq!(offset("hidden"), Some(std::mem::offset_of!(LabelUniform, hidden)));
    }

    #[test]
    fn labels_have_up_to_64_bits() {
        assert_eq!(parse_label("18446744073709551615"), Ok(i128::from(u64::MAX)));
        assert_eq!(parse_label("-9223372036854775808"), Ok(i128::from(i64::MIN)));
        for bad in ["18446744073709551616", "-9223372036854775809", "0", "1.5", "cells", ""] {
            assert!(parse_label(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn colours_follow_from_every_bit_and_those_of_the_file_come_first() {
        let colors = LabelColors::new([(7, [1, 2, 3, 4]), (u64::MAX, [9; 4]), (7, [5; 4])]);
        assert_eq!((colors.of(7), colors.of(u64::MAX), colors.of(0)), ([1, 2, 3, 4], [9; 4], [0; 4]));
        let labels = (0..64).map(|bit| 1u64 << bit).chain([1 << 32 | 1, 2 << 32 | 1]);
        let mut seen: Vec<[u8; 3]> = labels.map(usual_color).collect();
        let count = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), count, "no two of them share a colour");
        // Bright enough on black, and never grey.
        let spread = |codes: &[u8; 3]| codes.iter().max().unwrap() - codes.iter().min().unwrap();
        assert!(
            seen.iter().all(|codes| *codes.iter().max().unwrap() >= 160 && spread(codes) >= 80),
            "{seen:?}"
        );
    }

    /// As often as a list of so many can be halved.
    #[test]
    fn a_voxel_takes_a_turn_and_those_that_find_it_among_several_hidden_ones() {
        let hiding = |count| LabelColors::new((1..=count).map(|label| (label, [9, 9, 9, 0])));
        let turns = |count, others| hiding(count).turns(others);
        let voxel = |count| turns(count, None).per_voxel;
        assert_eq!([0, 1, 2, 3, 4, 7, 8].map(voxel), [1, 1, 3, 3, 4, 4, 5]);
        let seen = LabelColors::new([(0, [0; 4]), (1, [0, 0, 0, 1]), (2, [0; 4])]);
        assert_eq!(seen.turns(None).per_voxel, 1, "one is hidden");
        let both = OtherLabels::ALL.map(|others| turns(3, Some(others)));
        assert_eq!(both.map(|turns| (turns.per_voxel, turns.looks)), [(4, 2), (1, 1)]);
    }

    #[test]
    fn labels_of_other_voxels_lie_where_they_are_in_the_world() {
        let image = VolumeBox::new([40, 30, 20], [0.5, 0.5, 2.0]);
        let own = VolumeBox::new([10, 10, 10], [1.0, 1.5, 4.0]);
        let rays = VolumeView::Face(VolumeFace::PlusZ).rays(&image, [40, 30]);
        let begin = DVec3::new(2.0, 1.5, 0.0);
        let [scale, shift, from] = place(&own, begin, image.voxel, &rays, [20, 15, 10]);
        // The middle of voxel 24, 17, 11 of the image, in voxels of the labels.
        let offset = [24.5 - 20.0, 17.5 - 15.0, 11.5 - 10.0];
        let world = [24.5 * 0.5 - 2.0, 17.5 * 0.5 - 1.5, 11.5 * 2.0];
        for axis in 0..3 {
            let place = offset[axis] * scale[axis] + shift[axis] + from[axis];
            assert!((place - world[axis] / own.voxel[axis]).abs() < 1e-9, "{axis}");
        }
        // Where both are the same nothing is added.
        let [scale, shift, from] = place(&image, DVec3::ZERO, image.voxel, &rays, [20, 15, 0]);
        assert_eq!([scale, shift, from], [DVec3::ONE, DVec3::ZERO, DVec3::new(20.0, 15.0, 0.0)]);
    }
}
