//! What the shaders of a scene are told in each frame: one uniform buffer, in a bind group of its own.

use bytemuck::NoUninit;

/// The bind group and its buffer, for vertex and fragment shaders, at binding 0.
#[derive(Debug)]
pub struct Uniform {
    buffer: wgpu::Buffer,
    /// What passes bind.
    pub group: wgpu::BindGroup,
}

impl Uniform {
    /// The layout of its bind group.
    pub fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
        Uniform::layout_in(device, wgpu::BufferUsages::UNIFORM)
    }

    /// A layout as of uniforms, for a buffer of another kind: a storage buffer that shaders only read, where
    /// `usage` is `STORAGE`.
    pub fn layout_in(device: &wgpu::Device, usage: wgpu::BufferUsages) -> wgpu::BindGroupLayout {
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("scene"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: Uniform::binding_in(usage),
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        })
    }

    /// The binding of a buffer of this kind.
    pub fn binding_in(usage: wgpu::BufferUsages) -> wgpu::BufferBindingType {
        match usage {
            wgpu::BufferUsages::STORAGE => wgpu::BufferBindingType::Storage { read_only: true },
            _ => wgpu::BufferBindingType::Uniform,
        }
    }

    /// With room for a `T`.
    pub fn new<T: NoUninit>(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> Uniform {
        Uniform::new_in::<T>(device, layout, wgpu::BufferUsages::UNIFORM)
    }

    /// A value in a buffer of another kind, for a layout of that kind.
    pub fn new_in<T: NoUninit>(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        usage: wgpu::BufferUsages,
    ) -> Uniform {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("scene"),
            size: size_of::<T>() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        Uniform { buffer, group }
    }

    /// What is told from here on: a `T` as [`Uniform::new`] made room for.
    pub fn set<T: NoUninit>(&self, queue: &wgpu::Queue, told: &T) {
        queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(told));
    }
}
