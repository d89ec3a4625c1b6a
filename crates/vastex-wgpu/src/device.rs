//! What is asked of a device, and how its failures are seen without installing anything on it.

use std::future::Future;
use std::task::{Context, Poll, Waker};

use vastex_core::ArrayLimits;

use crate::error::GpuError;
use crate::module::shader_module;

/// What the device allows for the textures of pools: what a [`vastex_core::PoolLayout`] is made with.
pub fn limits(device: &wgpu::Device) -> ArrayLimits {
    array_limits(&device.limits())
}

/// What a device of these limits allows for the textures of pools.
pub fn array_limits(limits: &wgpu::Limits) -> ArrayLimits {
    ArrayLimits {
        max_side: limits.max_texture_dimension_2d,
        max_images: limits.max_texture_array_layers,
        max_side_3d: limits.max_texture_dimension_3d,
    }
}

/// The features worth asking the adapter for. Without them everything works: 16-bit data and 32-bit floats
/// are filtered in the shader, a little slower; block-compressed layers are decoded before they are uploaded,
/// and take more of the pool.
pub fn required_features(adapter: &wgpu::Adapter) -> wgpu::Features {
    use wgpu::TextureFormat::{R16Unorm, Rgba16Unorm};
    let norm16 = wgpu::Features::TEXTURE_FORMAT_16BIT_NORM;
    let mut features = norm16 | wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::TEXTURE_COMPRESSION_BC;
    features &= adapter.features();
    let is_filtered = |format| {
        let flags = adapter.get_texture_format_features(format).flags;
        flags.contains(wgpu::TextureFormatFeatureFlags::FILTERABLE)
    };
    if features.contains(norm16) && ![R16Unorm, Rgba16Unorm].into_iter().all(is_filtered) {
        features.remove(norm16);
    }
    features
}

/// The limits worth asking the adapter for: WebGPU's, or of an adapter that has less those of OpenGL ES 3.1
/// or WebGL 2, and whatever it allows of what pools and page tables are made of. With less than that
/// everything works too: pools are smaller, and [`FeedbackMode::best`](crate::FeedbackMode::best) finds
/// another mode.
pub fn required_limits(adapter: &wgpu::Adapter) -> wgpu::Limits {
    let has = adapter.limits();
    let known = [wgpu::Limits::default(), wgpu::Limits::downlevel_defaults()];
    let within = known.into_iter().find(|limits| limits.check_limits(&has));
    wgpu::Limits {
        max_texture_dimension_2d: has.max_texture_dimension_2d,
        max_texture_array_layers: has.max_texture_array_layers,
        max_buffer_size: has.max_buffer_size,
        max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
        ..within.unwrap_or_else(wgpu::Limits::downlevel_webgl2_defaults)
    }
}

/// Fails where the device is already lost, so that nothing is made that could not be used without a panic.
pub fn alive(device: &wgpu::Device) -> Result<(), GpuError> {
    #[cfg(feature = "test-device")]
    if crate::test_counters::is_to_fail() {
        return Err(GpuError::DeviceLost);
    }
    let probe = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vastex probe"),
        size: 4,
        usage: wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    });
    probe.get_mapped_range_mut(..).map(|_| ()).map_err(|_| GpuError::DeviceLost)
}

/// Lets the device call back what is due, so that it shows what has come back from it. Never waits. To be
/// called once per frame, before [`Readback::poll`](crate::Readback::poll); a submission of commands does the
/// same.
pub fn poll(device: &wgpu::Device) -> Result<(), GpuError> {
    poll_device(device, wgpu::PollType::Poll)
}

/// Lets the device call back what is due; waits where `poll` says so.
pub(crate) fn poll_device(device: &wgpu::Device, poll: wgpu::PollType) -> Result<(), GpuError> {
    #[cfg(feature = "test-device")]
    crate::test_counters::count_poll();
    device.poll(poll).map(|_| ()).map_err(|_| GpuError::DeviceLost)
}

/// Makes something of `bytes` bytes that may be too large for the device's memory, and says so.
///
/// In a browser the answer comes only later; there the device reports it as an uncaptured error.
pub(crate) fn guarded<T>(device: &wgpu::Device, bytes: u64, make: impl FnOnce() -> T) -> Result<T, GpuError> {
    #[cfg(feature = "test-device")]
    if crate::test_counters::is_to_fail() {
        return Err(GpuError::OutOfMemory { bytes });
    }
    let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let made = make();
    match now(scope.pop()) {
        Some(Some(_)) => Err(GpuError::OutOfMemory { bytes }),
        _ => Ok(made),
    }
}

/// Returns true if the device refuses to make something. Where the answer comes only later, as in a browser,
/// it is taken to be no.
pub(crate) fn refused<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> bool {
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    let refused = matches!(now(scope.pop()), Some(Some(_)));
    drop(made);
    refused
}

/// Makes something, and says whether the device takes all of it; where the answer comes only later, as in a
/// browser, it is taken to be yes.
pub(crate) fn validated<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> (T, bool) {
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    (made, !matches!(now(scope.pop()), Some(Some(_))))
}

/// What a future gives if it is ready at once.
fn now<T>(future: impl Future<Output = T>) -> Option<T> {
    match std::pin::pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => Some(value),
        Poll::Pending => None,
    }
}

/// The type of a whole buffer's binding, without a dynamic offset.
pub(crate) fn whole_buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A uniform buffer with its first contents.
pub(crate) fn uniform<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    contents: &T,
) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size_of::<T>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytemuck::bytes_of(contents));
    buffer
}

/// Whole words to be copied by commands, for which no later write takes their place; nothing on a lost
/// device.
pub(crate) fn staged(device: &wgpu::Device, label: &str, bytes: &[u8]) -> Option<wgpu::Buffer> {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    });
    let mut mapped = buffer.get_mapped_range_mut(..).ok()?;
    mapped.copy_from_slice(bytes);
    drop(mapped);
    buffer.unmap();
    Some(buffer)
}

/// A storage buffer that is cleared, written and copied, but never mapped.
pub(crate) fn storage(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    })
}

/// A texture of whole numbers that shaders read like an array, of so many texels along x and y.
pub(crate) fn words_texture(
    device: &wgpu::Device,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// Compute pipelines of one shader, one for each entry point, that see the same bind group.
pub(crate) fn compute_pipelines<const N: usize>(
    device: &wgpu::Device,
    label: &str,
    text: String,
    bindings: &[wgpu::BindingType],
    entry_points: [&str; N],
) -> (wgpu::BindGroupLayout, [wgpu::ComputePipeline; N]) {
    let entries: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect();
    let group = device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(&group)],
        immediate_size: 0,
    });
    let module = shader_module(device, Some(label), text);
    #[cfg(feature = "test-device")]
    crate::test_counters::count_compute_pipelines(N as u32);
    let pipelines = entry_points.map(|entry_point| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        })
    });
    (group, pipelines)
}

/// Workgroups along x and y that make at least `groups`, within what every device allows.
pub(crate) fn dispatch_size(groups: u32) -> [u32; 2] {
    const MAX: u32 = 65535;
    let x = groups.clamp(1, MAX);
    [x, groups.div_ceil(x)]
}
