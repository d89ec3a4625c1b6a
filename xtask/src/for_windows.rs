//! `cargo xtask campaign windows`: the workspace compiled for Windows, on another system.
//!
//! The suite compiles for the system that it runs on, so that nobody would see what fails to compile on
//! Windows alone.
//! Nothing is linked or run: BC7's encoder brings no library for MinGW, which is the C compiler. Rust's own
//! libraries come from rustup.

use anyhow::{Context, Result};

use crate::setup::{self, MINGW, NASM};
use crate::{once, shell};

const TARGET: &str = "x86_64-pc-windows-gnu";

/// Checks the workspace with its default features, its tests and examples too. Takes as long as a compile.
pub(crate) fn check() -> Result<()> {
    setup::ensure(&MINGW)?;
    setup::ensure(&NASM)?;
    shell::run(shell::command("rustup").args(["target", "add", TARGET]))
        .with_context(|| format!("the compiler has no {TARGET}; add it to your toolchain"))?;
    let mut check = shell::cargo("check");
    // Lints are those of the native code.
    check.args(["--workspace", "--all-targets", "--target", TARGET]).env_remove(once::WRAPPER);
    shell::run(&mut check).context("not everything compiles for Windows")
}
