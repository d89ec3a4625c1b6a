//! A device for the program: what a driver complains about that nobody waits for ends the program with a
//! message.

use vastex_scenes::Gpu;

use crate::report;

/// Ends the program with exit code 1 where the device refuses something and no call reports it, as for want
/// of memory.
pub(crate) fn report_refusals(gpu: &Gpu) {
    let adapter = gpu.adapter_name();
    gpu.device.on_uncaptured_error(std::sync::Arc::new(move |error| {
        report::say(&format!("error: {adapter} refused: {error}; try a smaller picture or a smaller pool"));
        std::process::exit(1);
    }));
}
