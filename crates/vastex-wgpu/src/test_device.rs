//! What tests have of a device: one to test on (whatever adapter there is, at WebGPU's default limits),
//! counts of what was made on it, and failures at chosen steps.

use std::time::Duration;

pub use crate::test_counters::{compute_pipelines, fail_after, polls};

/// Names the adapter that tests are to run on, or a part of its name; the variable that wgpu's own tools go
/// by.
const ADAPTER: &str = "WGPU_ADAPTER_NAME";
/// Longer than what a test submits takes on any adapter.
const PATIENCE: Duration = Duration::from_secs(300);

/// Panics where tests are to run on another adapter, so that what is said to have been tested on one driver
/// was not drawn by another.
#[expect(clippy::panic, reason = "a test on the wrong adapter must fail")]
pub fn check_adapter(info: &wgpu::AdapterInfo) {
    if let Some(name) = std::env::var_os(ADAPTER)
        && !is_called(info, &name.to_string_lossy())
    {
        panic!("{ADAPTER} asks for {}, and the adapter is {} ({})", name.display(), info.name, info.driver);
    }
}

fn is_called(info: &wgpu::AdapterInfo, name: &str) -> bool {
    info.name.to_lowercase().contains(&name.to_lowercase())
}

/// Waits until the device has done all that was submitted and has answered whoever asked; panics where it
/// does not within five minutes.
#[expect(clippy::panic, reason = "a test whose device hangs must fail")]
pub fn finish(device: &wgpu::Device) {
    let wait = wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
    if let Err(error) = device.poll(wait) {
        panic!("the device has not done what was submitted within {PATIENCE:?}: {error}");
    }
}

/// What a test needs of a GPU.
#[derive(Debug)]
pub struct TestDevice {
    /// The device.
    pub device: wgpu::Device,
    /// The device's queue.
    pub queue: wgpu::Queue,
    /// What the adapter is.
    pub info: wgpu::AdapterInfo,
}

impl TestDevice {
    /// A device with the features worth asking for ([`required_features`](crate::required_features)). Panics
    /// where there is none: a GPU test is never skipped.
    pub fn new() -> TestDevice {
        TestDevice::with_features(crate::required_features)
    }

    /// A device with the features that `choose` asks the adapter for.
    #[expect(clippy::panic, reason = "a test without an adapter must fail, and say what to do")]
    pub fn with_features(choose: impl Fn(&wgpu::Adapter) -> wgpu::Features) -> TestDevice {
        let described = wgpu::InstanceDescriptor::new_without_display_handle();
        let instance = pollster::block_on(crate::instance_for(described));
        let request = instance.request_adapter(&wgpu::RequestAdapterOptions::default());
        let adapter = pollster::block_on(request).unwrap_or_else(|error| {
            panic!(
                "no GPU adapter, not even in software ({error}); run `cargo xtask test`, which installs one"
            )
        });
        check_adapter(&adapter.get_info());
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("vastex test"),
            required_features: choose(&adapter),
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(request)
            .unwrap_or_else(|error| panic!("{}: {error}", adapter.get_info().name));
        TestDevice { device, queue, info: adapter.get_info() }
    }

    /// Returns true if the adapter is a processor: what draws is a software driver.
    pub fn is_processor(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }
}

impl Default for TestDevice {
    fn default() -> TestDevice {
        TestDevice::new()
    }
}
