//! A device by OpenGL; where the driver gives none, what is known of that.

use std::fmt::Write;
use std::sync::{Mutex, Once, PoisonError};
use std::time::Duration;

use vastex_scenes::Gpu;

/// How often a device is asked for: in turns with the driver's messages of what is wrong and without. wgpu's
/// own tests, many at once, have been told by NVIDIA's driver that devices are lost (gfx-rs/wgpu#7068).
const TRIES: u64 = 4;
/// Lines of what was said that are kept.
const MOST_SAID: usize = 100;

/// What wgpu has said of OpenGL in this process, and the driver through it.
static SAID: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Listener;

impl log::Log for Listener {
    fn enabled(&self, of: &log::Metadata<'_>) -> bool {
        of.level() <= log::Level::Warn && of.target().contains("gles")
    }

    fn log(&self, record: &log::Record<'_>) {
        let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
        if self.enabled(record.metadata()) && said.len() < MOST_SAID {
            said.push(format!("{}: {}", record.level(), record.args()));
        }
    }

    fn flush(&self) {}
}

fn listen() {
    static LISTENS: Once = Once::new();
    LISTENS.call_once(|| {
        log::set_logger(&Listener).unwrap();
        log::set_max_level(log::LevelFilter::Warn);
    });
}

/// A device with these limits, or nothing where the machine has no adapter of OpenGL. Panics where there is
/// an adapter, but no device.
#[expect(clippy::print_stdout, reason = "what is tested, and what is not")]
pub(crate) fn device(limits: &wgpu::Limits) -> Option<Gpu> {
    listen();
    let mut known = String::new();
    for attempt in 0..TRIES {
        let described = wgpu::InstanceDescriptor::new_without_display_handle();
        let checks = wgpu::InstanceFlags::DEBUG | wgpu::InstanceFlags::VALIDATION;
        let flags =
            if attempt % 2 == 0 { described.flags | checks } else { described.flags.difference(checks) };
        let descriptor = wgpu::InstanceDescriptor { backends: wgpu::Backends::GL, flags, ..described };
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()));
        let adapter = match adapter {
            Ok(adapter) => adapter,
            Err(why) => {
                println!("NOT TESTED: this machine has no OpenGL driver ({why}); on Debian it is libegl1");
                return None;
            }
        };
        let info = adapter.get_info();
        println!("by OpenGL on {}, {} {}", info.name, info.driver, info.driver_info);
        let required_limits = limits.clone();
        let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
        match pollster::block_on(adapter.request_device(&descriptor)) {
            Ok((device, queue)) => {
                print!("{known}");
                return Some(Gpu::new(instance, adapter, device, queue));
            }
            Err(why) => writeln!(known, "attempt {attempt} with {flags:?}: {why:?}").unwrap(),
        }
        std::thread::sleep(Duration::from_millis(250 * attempt));
    }
    let said = SAID.lock().unwrap_or_else(PoisonError::into_inner).join("\n");
    panic!(
        "this machine has an adapter of OpenGL, but it gives no device:\n{known}\nThe driver said:\n{said}\n\
         wgpu calls a device lost if the driver maps none of its buffers. If this test passes alone \
         (`--exact --test-threads=1`), it is what other threads do at the same time."
    );
}
