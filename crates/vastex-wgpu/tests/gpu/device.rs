//! Which adapter the tests run on.

use vastex_wgpu::test_device::TestDevice;

/// Says it, too: the suite's step for a second driver reads it here.
#[test]
fn the_adapter_is_the_one_that_is_asked_for() {
    let info = TestDevice::new().info;
    println!("adapter: {} ({}), {} {}", info.name, info.backend, info.driver, info.driver_info);
}
