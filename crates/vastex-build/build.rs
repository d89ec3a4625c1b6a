//! Says when the JPEG decoder was compiled without its SIMD code. Its own build script warns too, but Cargo
//! shows warnings of the workspace's crates only.
//!
//! Sets the cfg `jpeg_simd` where the decoder has it.

#![allow(clippy::print_stdout, reason = "a build script talks to Cargo on its standard output")]

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(jpeg_simd)");
    let target = std::env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
    if has_simd() {
        println!("cargo::rustc-cfg=jpeg_simd");
    } else if target == "x86" || target == "x86_64" {
        println!(
            "cargo::warning=JPEG images will be read about three times slower: there was no nasm when mozjpeg-sys was \
             compiled. Install nasm, then `cargo clean -p mozjpeg-sys` (for a release build with --release) and build again."
        );
    }
}

/// Returns true if the configuration that mozjpeg-sys was compiled with names SIMD. The first of the
/// directories that it tells of has it.
fn has_simd() -> bool {
    let Some(directories) = std::env::var_os("DEP_JPEG_INCLUDE") else { return false };
    let config = |directory: &Path| std::fs::read_to_string(directory.join("jconfig.h")).unwrap_or_default();
    let mut directories = std::env::split_paths(&directories);
    directories.any(|directory| config(&directory).contains("#define WITH_SIMD 1"))
}
