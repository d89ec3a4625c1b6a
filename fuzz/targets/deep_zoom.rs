#![no_main]

vastex_fuzz_targets::fuzz!("deep_zoom");
