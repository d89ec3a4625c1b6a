//! Which crate may depend on which, and what no build of a crate may bring in.

use anyhow::{Result, ensure};

use crate::sources::{features_of, root};
use crate::tree::{WASM, crates, direct};

/// The house: each crate and the crates of the house that it may use. Tests and examples may use more.
const ARROWS: &[(&str, &[&str])] = &[
    ("vastex-core", &[]),
    ("vastex-tiles", &["vastex-core"]),
    // Levels are made of volumes that are read there.
    ("vastex-build", &["vastex-core", "vastex-tiles", "vastex-volume"]),
    ("vastex-volume", &["vastex-core", "vastex-tiles"]),
    ("vastex-fuzz", &["vastex-core", "vastex-tiles", "vastex-build", "vastex-volume"]),
    ("vastex-wgpu", &["vastex-core"]),
    ("vastex", &["vastex-core", "vastex-tiles", "vastex-wgpu"]),
    ("vastex-viewer", &["vastex"]),
    ("vastex-scenes", &["vastex", "vastex-viewer"]),
    ("vastex-browser", &["vastex", "vastex-viewer"]),
    (
        "vastex-cli",
        &[
            "vastex-core",
            "vastex-tiles",
            "vastex-build",
            "vastex-wgpu",
            "vastex",
            "vastex-viewer",
            "vastex-scenes",
            "vastex-volume",
        ],
    ),
    ("xtask", &[]),
];

/// The crates that also run in a browser, as options for cargo.
#[rustfmt::skip]
const BROWSER: &[&str] = &[
    "-p", "vastex-core", "-p", "vastex-tiles", "-p", "vastex-wgpu", "-p", "vastex", "-p", "vastex-viewer",
    "-p", "vastex-browser",
];

/// Core needs next to nothing; whoever adds to this list says why core cannot do without.
const CORE_MAY_USE: &[&str] = &["bytes", "rustc-hash", "thiserror"];

#[test]
fn every_arrow_of_the_house_is_allowed() -> Result<()> {
    for options in [&["--workspace"][..], &[BROWSER, WASM].concat()] {
        for (package, dependencies) in direct(options)? {
            let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| *name == package) else {
                anyhow::bail!(
                    "{package} has no place in the house: give it a row of ARROWS and one in ARCHITECTURE.md"
                );
            };
            let own = dependencies.iter().filter(|name| ARROWS.iter().any(|(house, _)| house == name));
            let wrong: Vec<&String> = own.filter(|name| !allowed.contains(&name.as_str())).collect();
            ensure!(wrong.is_empty(), "{package} -> {wrong:?} is no arrow of the house");
        }
    }
    Ok(())
}

#[test]
fn the_house_is_whole() -> Result<()> {
    let members = direct(&["--workspace"])?;
    for (name, _) in ARROWS {
        ensure!(members.contains_key(*name), "{name} is not in the workspace");
    }
    Ok(())
}

#[test]
fn core_uses_next_to_nothing() -> Result<()> {
    let direct = direct(&["-p", "vastex-core"])?;
    for name in direct.values().flatten() {
        ensure!(CORE_MAY_USE.contains(&name.as_str()), "vastex-core has taken up {name}");
    }
    Ok(())
}

#[test]
fn core_tiles_build_and_volume_never_see_a_gpu() -> Result<()> {
    for package in ["vastex-core", "vastex-tiles", "vastex-build", "vastex-volume"] {
        refuse(&["-p", package, "--all-features"], is_gpu)?;
    }
    Ok(())
}

#[test]
fn the_gpu_crates_and_their_tests_build_without_a_window() -> Result<()> {
    for package in ["vastex-wgpu", "vastex", "vastex-viewer", "vastex-scenes"] {
        refuse(&["-p", package, "--all-features", "-e", "normal,build,dev"], is_window)?;
    }
    // Panels are for hosts that ask for them.
    for package in ["vastex-wgpu", "vastex", "vastex-viewer", "vastex-scenes"] {
        refuse(&["-p", package, "-e", "normal,build"], |name| name == "egui")?;
    }
    Ok(())
}

#[test]
fn the_viewer_links_no_encoder() -> Result<()> {
    let program = std::fs::read_to_string(root().join("apps/vastex-cli/Cargo.toml"))?;
    let features: Vec<&str> =
        features_of(&program).filter(|name| !["default", "build", "bc"].contains(name)).collect();
    let without_build = format!("--features={}", features.join(","));
    refuse(&["-p", "vastex-cli", "--no-default-features", &without_build], is_encoder)
}

#[test]
fn nothing_in_the_browser_compiles_c() -> Result<()> {
    refuse(&[BROWSER, WASM].concat(), is_c)?;
    refuse(&[BROWSER, WASM, &["--no-default-features"]].concat(), is_c)
}

#[test]
fn the_names_that_are_refused_are_the_real_ones() {
    assert!(["wgpu", "wgpu-core", "naga"].into_iter().all(is_gpu));
    assert!(["winit", "egui-winit", "eframe"].into_iter().all(is_window));
    assert!(["mozjpeg", "mozjpeg-sys", "zstd", "zstd-sys", "vastex-build"].into_iter().all(is_encoder));
    assert!(!["ruzstd", "lz4_flex", "png", "vastex"].into_iter().any(is_encoder));
    assert!(["cc", "cmake", "zstd-sys"].into_iter().all(is_c));
    assert!(!["js-sys", "web-sys", "bytes"].into_iter().any(is_c));
}

fn refuse(options: &[&str], refused: fn(&str) -> bool) -> Result<()> {
    let found: Vec<String> = crates(options)?.into_iter().filter(|name| refused(name)).collect();
    ensure!(
        found.is_empty(),
        "cargo tree {options:?} brings in {found:?}; `cargo tree -i {}` says why",
        found[0]
    );
    Ok(())
}

fn is_gpu(name: &str) -> bool {
    ["wgpu", "naga", "ash", "vastex-wgpu"].iter().any(|gpu| name == *gpu || name.starts_with("wgpu-"))
}

fn is_window(name: &str) -> bool {
    // egui-wgpu without its feature `winit` knows no window: by it the viewer's widget gives egui its
    // picture.
    ["winit", "eframe", "softbuffer", "egui-winit"].contains(&name)
}

fn is_encoder(name: &str) -> bool {
    let starts = ["mozjpeg", "zstd", "intel_tex", "ctt-", "texpresso"];
    name == "vastex-build" || starts.iter().any(|start| name.starts_with(start))
}

/// C is compiled by way of these; bindings to what the browser itself brings are no C.
fn is_c(name: &str) -> bool {
    let bindings = ["js-sys", "web-sys"];
    ["cc", "cmake", "bindgen"].contains(&name) || (name.ends_with("-sys") && !bindings.contains(&name))
}
