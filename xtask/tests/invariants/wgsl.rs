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
