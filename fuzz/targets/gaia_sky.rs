#![no_main]

vastex_fuzz_targets::fuzz!("gaia_sky");
