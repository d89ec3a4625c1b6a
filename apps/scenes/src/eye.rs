//! What a scene is seen through: where it is looked at from, as its shaders are told.
//!
//! A scene has one of its own; passes that are drawn in one encoder from different places need one each.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use bytemuck::Zeroable;
use glam::{Mat4, Vec4};

use crate::draw::BACKGROUND;
use crate::patches::{MOST_PATCHES, Patch};
use crate::relief::{ReliefUniform, ReliefView};

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
    uniform: wgpu::Buffer,
    pub(crate) group: wgpu::BindGroup,
    /// Those of a surface with heights; room for one where it has none.
    pub(crate) patches: wgpu::Buffer,
    patch_count: AtomicU32,
}

impl Eye {
    pub(crate) fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, has_relief: bool) -> Eye {
        let buffer = |size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("scene"),
                size: size as u64,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let uniform = buffer(size_of::<SceneUniform>(), wgpu::BufferUsages::UNIFORM);
        let patches = if has_relief { MOST_PATCHES } else { 1 } * size_of::<Patch>();
        let patches = buffer(patches, wgpu::BufferUsages::VERTEX);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        Eye { uniform, group, patches, patch_count: AtomicU32::new(0) }
    }

    /// Where it looks, the range of values, the size of the picture, and what is seen of a surface with heights.
    pub(crate) fn set(
        &self,
        queue: &wgpu::Queue,
        clip_from_world: Mat4,
        [black, factor]: [f32; 2],
        [width, height]: [f32; 2],
        seen: Option<&ReliefView>,
    ) {
        let range_and_picture = Vec4::new(black, factor, width, height);
        let (background, relief) = (BACKGROUND, seen.map_or_else(Zeroable::zeroed, |seen| seen.uniform));
        let uniform = SceneUniform { clip_from_world, background, range_and_picture, relief };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        if let Some(seen) = seen {
            queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(&seen.patches));
            self.patch_count.store(seen.patches.len() as u32, Relaxed);
        }
    }

    pub(crate) fn patch_count(&self) -> u32 {
        self.patch_count.load(Relaxed)
    }
}

pub(crate) fn eye_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    })
}
