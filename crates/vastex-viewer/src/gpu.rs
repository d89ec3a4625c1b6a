//! A device to draw with: which adapter, with which limits, and what to do where there is none.
//!
//! What is kept beside a device, and for how long, is the business of the rooms that keep it.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// What a device needs to tell how long it takes for parts of a frame. Nothing else uses it.
const TIMES: wgpu::Features =
    wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum GpuSetupError {
    /// No driver offers an adapter.
    #[error(
        "no graphics adapter was found ({0}); install a Vulkan driver (on Debian and Ubuntu the software driver is the \
         package mesa-vulkan-drivers)"
    )]
    NoAdapter(String),
    /// An adapter is there and does not work.
    #[error("the graphics adapter {adapter} gives no device: {error}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What the adapter said.
        error: String,
    },
}

/// By their types.
type Kept = Arc<Mutex<HashMap<TypeId, Arc<dyn Any + Send + Sync>>>>;

/// A device, its queue, what it runs on, and what was made for it once and is used again: a scene like one
/// that was drawn before is drawn without compiling anything. Clones share all of that.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The instance that everything comes from.
    pub instance: wgpu::Instance,
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device, with the adapter's own limits. Another one goes into a [`Gpu::new`], since what was made
    /// for this one is no other's.
    pub device: wgpu::Device,
    /// The device's queue.
    pub queue: wgpu::Queue,
    kept: Kept,
}

impl Gpu {
    /// A device of the application's own.
    pub fn new(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Gpu {
        Gpu { instance, adapter, device, queue, kept: Kept::default() }
    }

    /// A device without a window, of Vulkan where that has an adapter. `WGPU_BACKEND` may name the interfaces
    /// to look for adapters behind: `vulkan`, `gl` ...
    pub async fn headless() -> Result<Gpu, GpuSetupError> {
        let described = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        Gpu::for_surface(vastex::instance_for(described).await, None).await
    }

    /// A device that can show pictures in a window or, without one, only draw them.
    pub async fn for_surface(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Gpu, GpuSetupError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let adapter = instance
            .request_adapter(&options)
            .await
            .map_err(|error| GpuSetupError::NoAdapter(error.to_string()))?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("vastex"),
            required_features: vastex::required_features(&adapter) | adapter.features() & TIMES,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|error| {
            GpuSetupError::NoDevice { adapter: adapter.get_info().name, error: error.to_string() }
        })?;
        Ok(Gpu::new(instance, adapter, device, queue))
    }

    /// What is kept of one type for this device, at first its default.
    pub(crate) fn kept<T: Any + Send + Sync + Default>(&self) -> Arc<T> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let of_type = kept.entry(TypeId::of::<T>()).or_insert_with(|| Arc::<T>::default());
        Arc::clone(of_type).downcast().unwrap_or_default()
    }

    /// Returns true if the adapter is a processor: what draws is a software driver.
    pub fn is_processor(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// The adapter's name and how it is driven.
    pub fn adapter_name(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({})", info.name, info.backend)
    }
}
