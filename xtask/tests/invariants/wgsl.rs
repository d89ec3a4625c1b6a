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
