//! Shader text is WGSL by the specification, and not only by the compiler that reads it natively.

#[path = "../../src/wgsl.rs"]
mod grammar;

use anyhow::Result;

use crate::sources::files;

#[test]
fn no_shader_mixes_operators_without_parentheses() -> Result<()> {
    let mut faults = Vec::new();
    for source in files(&["wgsl"])? {
        faults.extend(grammar::mixed(&source.text).iter().map(|fault| format!("{}, {fault}", source.path)));
    }
    assert!(faults.is_empty(), "a browser refuses these:\n{}", faults.join("\n"));
    Ok(())
}

/// Shaders outside vastex-wgpu that call what begins with `vastexi_`, which may change: applications have no
/// need of it. Each has a reason.
const CALL_INTERNALS: &[&str] = &[
    // Judge pictures: an ordinary texture is read at the very taps that the virtual one has.
    "apps/scenes/src/wgsl/planet_reference.wgsl",
    "crates/vastex-viewer/src/surface/wgsl/reference.wgsl",
    "crates/vastex-viewer/src/surface/wgsl/reference_picture.wgsl",
    // Shows the page table itself.
    "crates/vastex-viewer/src/overlay/wgsl/table.wgsl",
    // Takes the shorter way at a seam along the axes that wrap alone, of a layer chosen when it is drawn.
    "crates/vastex-viewer/src/surface/wgsl/mesh.wgsl",
    // Compares the levels of a pixel and of the vertices about it before either is rounded.
    "crates/vastex-viewer/src/surface/wgsl/relief_fixed.wgsl",
];

#[test]
fn shaders_of_scenes_use_public_names() -> Result<()> {
    let is_own = |path: &str| {
        ["crates/vastex-wgpu/", "/tests/", "/benches/"].iter().all(|folder| !path.contains(folder))
    };
    let internal = |text: &str| {
        let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
        code.into_iter().any(|line| line.to_lowercase().contains("vastexi_"))
    };
    let shaders =
        files(&["wgsl"])?.into_iter().filter(|source| is_own(&source.path) && internal(&source.text));
    let mut callers: Vec<String> = shaders.map(|source| source.path).collect();
    callers.sort();
    let mut expected = CALL_INTERNALS.to_vec();
    expected.sort_unstable();
    assert_eq!(callers, expected, "applications call vastex_ alone; say in CALL_INTERNALS why not");
    Ok(())
}

#[test]
fn every_shader_module_is_made_in_one_place() -> Result<()> {
    const PLACE: &str = "crates/vastex-wgpu/src/module.rs";
    let call = ["create_shader", "_module"].concat();
    let callers = files(&["rs"])?.into_iter().filter(|source| source.text.contains(&call));
    let callers: Vec<String> = callers.map(|source| source.path).collect();
    assert_eq!(
        callers,
        [PLACE],
        "a text that does not go through vastex_wgpu::shader_module is one that no list knows"
    );
    Ok(())
}
