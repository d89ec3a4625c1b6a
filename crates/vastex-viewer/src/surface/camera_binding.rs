//! What a scene is seen through: where it is looked at from, as its shaders are told.
//!
//! A scene has one of its own; passes that are drawn in one encoder from different places need one each.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

use bytemuck::Zeroable;
use glam::{Mat4, Vec4};

use super::fixed::FixedUniform;
use super::patches::{MOST_PATCHES, Patch};
use super::relief::{ReliefUniform, ReliefView};
use crate::layers::{BACKGROUND, ColorMap};
use crate::stage::Uniform;

/// What the shaders are told about the scene; laid out as `Scene` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct SceneUniform {
    clip_from_world: Mat4,
    background: Vec4,
    range_and_picture: Vec4,
    relief: ReliefUniform,
    ids: [u32; 4],
    fixed: FixedUniform,
}

/// What shaders are told of a camera, and the bind group that tells them. Made by [`crate::SceneRenderer::new_camera`].
#[derive(Debug)]
pub struct CameraBinding {
    uniform: Uniform,
    /// Those of a surface with heights; room for one where it has none.
    pub(crate) patches: wgpu::Buffer,
    patch_count: AtomicU32,
    /// The number by which shaders know its view.
    view: u32,
    is_fixed: AtomicBool,
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
        CameraBinding { uniform, patches, patch_count, view: 0, is_fixed }
    }

    /// The same for another view than the main one: [`vastex::View::number`].
    #[must_use]
    pub fn with_view(self, view: u32) -> CameraBinding {
        CameraBinding { view, ..self }
    }

    /// Where it looks, the ids of what is drawn together and of colour and heights, the range of values, the size of the picture, and what is
    /// seen of a surface with heights, or of one in fixed point.
    pub(crate) fn set(
        &self,
        queue: &wgpu::Queue,
        clip_from_world: Mat4,
        ids: [u32; 3],
        color_map: &ColorMap,
        picture: [f32; 2],
        (seen, fixed): (Option<&ReliefView>, Option<FixedUniform>),
    ) {
        let [black, factor] = color_map.range();
        let range_and_picture = Vec4::new(black, factor, picture[0], picture[1]);
        let (background, relief) =
            (color_map.background(), seen.map_or_else(Zeroable::zeroed, |seen| seen.uniform));
        let [all, color, height] = ids;
        let ids = [all, color, height, self.view];
        self.uniform.set(
            queue,
            &SceneUniform {
                clip_from_world,
                background,
                range_and_picture,
                relief,
                ids,
                fixed: fixed.unwrap_or_else(Zeroable::zeroed),
            },
        );
        self.is_fixed.store(fixed.is_some(), Relaxed);
        if let Some(seen) = seen {
            queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(&seen.patches));
            self.patch_count.store(seen.patches.len() as u32, Relaxed);
        }
    }

    /// Where it looks at a scene whose layers are told by themselves, over the background as light.
    /// `all` is the id of the group of all layers.
    pub(crate) fn set_light(
        &self,
        queue: &wgpu::Queue,
        clip_from_world: Mat4,
        all: u32,
        [width, height]: [f32; 2],
    ) {
        let told = SceneUniform {
            clip_from_world,
            background: BACKGROUND,
            range_and_picture: Vec4::new(0.0, 1.0, width, height),
            ids: [all, 0, 0, self.view],
            ..Zeroable::zeroed()
        };
        self.uniform.set(queue, &told);
    }

    pub(crate) fn group(&self) -> &wgpu::BindGroup {
        &self.uniform.group
    }

    /// Whether every pixel is to work out by itself what it sees.
    pub(crate) fn is_fixed(&self) -> bool {
        self.is_fixed.load(Relaxed)
    }

    pub(crate) fn patch_count(&self) -> u32 {
        self.patch_count.load(Relaxed)
    }
}
