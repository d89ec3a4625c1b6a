//! What a scene is seen through: where it is looked at from, as its shaders are told.
//!
//! A scene has one of its own; passes that are drawn in one encoder from different places need one each.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
#[cfg(feature = "egui")]
use std::sync::{Mutex, PoisonError};

use bytemuck::Zeroable;
use glam::{Mat4, Vec4};

use super::fixed::{FixedUniform, LayerPlace};
use super::fixed_relief::{FixedReliefView, GridUniform};
use super::patches::{MOST_PATCHES, Patch};
use super::planet::PlanetUniform;
use super::relief::{ReliefUniform, ReliefView};
use crate::layers::{ColorMap, Ground, MOST_LAYERS, PaletteUniform, Panes};
use crate::picture::PicturePart;
use crate::stage::Uniform;

/// What the shaders are told about the scene; laid out as `Scene` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct SceneUniform {
    clip_from_world: Mat4,
    background: Vec4,
    tone: Vec4,
    picture: [f32; 2],
    map: u32,
    nodata: f32,
    part: Vec4,
    origin: [f32; 2],
    panes: f32,
    unused: f32,
    nodata_color: Vec4,
    ground: Vec4,
    growing: Vec4,
    /// The first of each counts; see `scene_zero` in surface.wgsl.
    relief: [ReliefUniform; 2],
    ids: [u32; 4],
    fixed: [FixedUniform; 2],
    grid: [GridUniform; 2],
    places: Places,
    planet: PlanetUniform,
    palette: PaletteUniform,
}

/// Of each layer of a list, of heights, and of what is wanted together.
pub(crate) type Places = [LayerPlace; MOST_LAYERS + 2];

/// How a camera sees a surface.
pub(crate) enum Placed {
    /// As a mesh.
    Mesh(Mat4),
    /// As patches, displaced by heights.
    Relief(ReliefView),
    /// In fixed point, by every pixel.
    Fixed(FixedUniform),
    /// As patches in fixed point.
    FixedRelief(FixedReliefView),
}

/// What shaders are told of a camera, and the bind group that tells them. Made by
/// [`crate::SceneRenderer::new_camera`].
#[derive(Debug)]
pub struct CameraBinding {
    uniform: Uniform,
    /// Patches of a surface with heights; room for one where it has none.
    pub(crate) patches: wgpu::Buffer,
    patch_count: AtomicU32,
    /// The number by which shaders know its view.
    view: u32,
    is_fixed: AtomicBool,
    /// The left edge of the first pane, and width and height of each, in pixels.
    pane: [AtomicU32; 3],
    /// The bytes that its uniform and its patches have on the GPU, by which pictures are compared that may be
    /// kept.
    #[cfg(feature = "egui")]
    last_bytes: Mutex<Vec<u8>>,
}

impl CameraBinding {
    pub(crate) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        has_relief: bool,
    ) -> CameraBinding {
        let patches = if has_relief { MOST_PATCHES } else { 1 } * size_of::<Patch>();
        let patches = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("patches"),
            size: patches as u64,
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let uniform = Uniform::new::<SceneUniform>(device, layout);
        let (patch_count, is_fixed) = (AtomicU32::new(0), AtomicBool::new(false));
        let pane = [0, 1, 1].map(AtomicU32::new);
        CameraBinding {
            uniform,
            patches,
            patch_count,
            view: 0,
            is_fixed,
            pane,
            #[cfg(feature = "egui")]
            last_bytes: Mutex::default(),
        }
    }

    /// This binding for another view than the main one: [`vastex::ViewRef::number`].
    #[must_use]
    pub fn with_view(self, view: u32) -> CameraBinding {
        CameraBinding { view, ..self }
    }

    /// How it sees the surface, where in fixed point textures are that have sizes of their own, how a planet
    /// is lit, and where rows end of a texture that grows; the ids of what is wanted together, of the colours
    /// and of the heights; how values become colours; which part of a pane of the picture is drawn, which
    /// part of what the camera sees, and where panes are; and what is seen around and through the surface.
    pub(super) fn set(
        &self,
        queue: &wgpu::Queue,
        (placed, places, planet, [uv, row]): (&Placed, Places, Option<PlanetUniform>, [f32; 2]),
        [all, color, height]: [u32; 3],
        color_map: &ColorMap,
        (part, seen, panes, ground): (PicturePart, PicturePart, &Panes, Ground),
    ) {
        let [background, ground] = color_map.ground(ground);
        let pane = part.whole;
        let [scale, offset] = seen.whole_from_part();
        let mut told = SceneUniform {
            background,
            ground,
            growing: Vec4::new(uv, row, 0.0, 0.0),
            tone: color_map.tone().told().into(),
            picture: pane.map(|side| side as f32),
            map: color_map.map(),
            palette: color_map.palette().uniform(),
            nodata: color_map.nodata(),
            nodata_color: color_map.nodata_color(),
            part: scale.as_vec2().extend(offset.x as f32).extend(offset.y as f32),
            origin: [part.at[0] as f32 - panes.left as f32, part.at[1] as f32],
            panes: panes.stretch() as f32,
            ids: [all, color, height, self.view],
            places,
            planet: planet.unwrap_or(Zeroable::zeroed()),
            ..Zeroable::zeroed()
        };
        let mut patches: &[u8] = &[];
        match placed {
            Placed::Mesh(clip_from_world) => told.clip_from_world = *clip_from_world,
            Placed::Fixed(fixed) => told.fixed[0] = *fixed,
            Placed::Relief(seen) => {
                (told.clip_from_world, told.relief[0]) = (seen.clip_from_world, seen.uniform);
                patches = bytemuck::cast_slice(&seen.patches);
            }
            Placed::FixedRelief(seen) => {
                (told.clip_from_world, told.relief[0]) = (seen.clip_from_local, seen.uniform);
                (told.fixed[0], told.grid[0]) = (seen.fixed, seen.grid);
                patches = bytemuck::cast_slice(&seen.patches);
            }
        }
        self.set_patches(queue, patches);
        self.uniform.set(queue, &told);
        #[cfg(feature = "egui")]
        {
            let mut bytes = self.last_bytes.lock().unwrap_or_else(PoisonError::into_inner);
            bytes.clear();
            bytes.extend_from_slice(bytemuck::bytes_of(&told));
            bytes.extend_from_slice(patches);
        }
        let pane = [panes.left, pane[0], pane[1]];
        self.pane.iter().zip(pane).for_each(|(told, side)| told.store(side, Relaxed));
        self.is_fixed.store(matches!(placed, Placed::Fixed(_) | Placed::FixedRelief(_)), Relaxed);
    }

    fn set_patches(&self, queue: &wgpu::Queue, patches: &[u8]) {
        if !patches.is_empty() {
            queue.write_buffer(&self.patches, 0, patches);
        }
        self.patch_count.store((patches.len() / size_of::<Patch>()) as u32, Relaxed);
    }

    /// What it told shaders last, byte by byte.
    #[cfg(feature = "egui")]
    pub(super) fn last_bytes(&self) -> Vec<u8> {
        self.last_bytes.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(crate) fn group(&self) -> &wgpu::BindGroup {
        &self.uniform.group
    }

    /// The left edge of the first pane, and width and height of each, in pixels.
    pub(crate) fn pane(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.pane[axis].load(Relaxed) as f32)
    }

    /// Returns true if it sees the surface in fixed point.
    pub(crate) fn is_fixed(&self) -> bool {
        self.is_fixed.load(Relaxed)
    }

    pub(crate) fn patch_count(&self) -> u32 {
        self.patch_count.load(Relaxed)
    }
}
