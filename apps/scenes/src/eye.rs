//! What a scene is seen through: where it is looked at from, as its shaders are told.
//!
//! A scene has one of its own; passes that are drawn in one encoder from different places need one each.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use bytemuck::Zeroable;
use glam::{Mat4, Vec4};

use crate::look::Look;
use crate::patches::{MOST_PATCHES, Patch};
use crate::relief::{ReliefUniform, ReliefView};
use crate::uniform::Uniform;

/// What the shaders are told about the scene; laid out as `Scene` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct SceneUniform {
    clip_from_world: Mat4,
    background: Vec4,
    range_and_picture: Vec4,
    relief: ReliefUniform,
}

/// See the head of the file. Made by [`crate::SceneRenderer::new_eye`].
#[derive(Debug)]
pub struct Eye {
    uniform: Uniform,
    /// Those of a surface with heights; room for one where it has none.
    pub(crate) patches: wgpu::Buffer,
    patch_count: AtomicU32,
}

impl Eye {
    pub(crate) fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, has_relief: bool) -> Eye {
        let patches = if has_relief { MOST_PATCHES } else { 1 } * size_of::<Patch>();
        let patches = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("patches"),
            size: patches as u64,
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let uniform = Uniform::new::<SceneUniform>(device, layout);
        Eye { uniform, patches, patch_count: AtomicU32::new(0) }
    }

    /// Where it looks, the range of values, the size of the picture, and what is seen of a surface with heights.
    pub(crate) fn set(
        &self,
        queue: &wgpu::Queue,
        clip_from_world: Mat4,
        look: &Look,
        [width, height]: [f32; 2],
        seen: Option<&ReliefView>,
    ) {
        let [black, factor] = look.range();
        let range_and_picture = Vec4::new(black, factor, width, height);
        let (background, relief) =
            (look.background(), seen.map_or_else(Zeroable::zeroed, |seen| seen.uniform));
        self.uniform.set(queue, &SceneUniform { clip_from_world, background, range_and_picture, relief });
        if let Some(seen) = seen {
            queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(&seen.patches));
            self.patch_count.store(seen.patches.len() as u32, Relaxed);
        }
    }

    pub(crate) fn group(&self) -> &wgpu::BindGroup {
        &self.uniform.group
    }

    pub(crate) fn patch_count(&self) -> u32 {
        self.patch_count.load(Relaxed)
    }
}
