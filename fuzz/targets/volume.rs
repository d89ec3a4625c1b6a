#![no_main]

vastex_fuzz_targets::fuzz!("volume");
