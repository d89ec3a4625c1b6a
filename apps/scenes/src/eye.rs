//! What a scene is seen through: where it is looked at from, as its shaders are told.
//!
//! A scene has one of its own; passes that are drawn in one encoder from different places need one each.

use glam::{Mat4, Vec4};

use crate::draw::BACKGROUND;

/// What the shaders are told about the scene; laid out as `Scene` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct SceneUniform {
    clip_from_world: Mat4,
    background: Vec4,
    range_and_picture: Vec4,
}

/// See the head of the file. Made by [`crate::SceneRenderer::new_eye`].
#[derive(Debug)]
pub struct Eye {
    uniform: wgpu::Buffer,
    pub(crate) group: wgpu::BindGroup,
}

impl Eye {
    pub(crate) fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> Eye {
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("scene"),
            size: size_of::<SceneUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        Eye { uniform, group }
    }

    pub(crate) fn set(
        &self,
        queue: &wgpu::Queue,
        clip_from_world: Mat4,
        [black, factor]: [f32; 2],
        [width, height]: [f32; 2],
    ) {
        let range_and_picture = Vec4::new(black, factor, width, height);
        let uniform = SceneUniform { clip_from_world, background: BACKGROUND, range_and_picture };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
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
