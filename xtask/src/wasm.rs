//! The step that compiles the crates of the browser for wasm32-unknown-unknown, and the compiler that does
//! it, which also makes the program of the step `web`.
//!
//! Where rustup has the target's standard library, the project's own compiler does it. Else Debian's second
//! Rust compiler does, building the standard library from the sources that come with it. Where neither is to
//! be had the step is skipped, loudly. Nothing is optimised. That no C is compiled for the target is an
//! invariant and tested as such.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, bail};

use crate::outcome::Outcome;
use crate::{once, setup, shell};

const TARGET: &str = "wasm32-unknown-unknown";
const CRATES: &[&str] =
    &["vastex-core", "vastex-tiles", "vastex-wgpu", "vastex", "vastex-viewer", "vastex-browser"];

const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_SOURCES: &str = "/usr/lib/rustlib/src/rust/library/std";
const DEBIAN_PACKAGES: &[&str] = &["rustc-web", "rust-web-src", "lld-22"];

/// What is compiled here is run once, if at all. That of vastex-wgpu has a level of its own.
const NOT_OPTIMISED: &[&str] = &[
    "--config",
    "profile.dev.debug=false",
    "--config",
    "profile.dev.opt-level=0",
    "--config",
    "profile.dev.package.\"*\".opt-level=0",
    "--config",
    "profile.dev.package.vastex-wgpu.opt-level=0",
];
/// Features, those first with which the program of the step `web` is compiled: what the others need is the
/// same for the most part, so that it is compiled once, and not checked apart from that.
const FEATURES: [&[&str]; 3] = [&["--no-default-features"], &[], &["--features", "vastex-viewer/egui"]];

/// A compiler with which the target can be built.
enum Toolchain {
    /// The toolchain of the project itself.
    Own,
    /// Debian's, with the standard library built from source.
    Debian,
}

pub(crate) fn check() -> Result<Outcome> {
    let Some(toolchain) = find_toolchain() else {
        println!(
            "\n!!!! SKIPPED: no compiler for {TARGET} could be installed, so nothing says whether it still builds !!!!\n"
        );
        return Ok(Outcome::Skipped(format!("no compiler for {TARGET}")));
    };
    for features in FEATURES {
        let mut command = cargo_for(&toolchain, "build");
        for name in CRATES {
            command.args(["-p", name]);
        }
        let said = shell::run_with_stderr(command.args(features))?;
        let warned: Vec<&str> = said.iter().map(String::as_str).filter(|line| is_warned(line)).collect();
        if !warned.is_empty() {
            bail!(
                "what the browser gets is compiled with warnings, which clippy does not see:\n{}",
                warned.join("\n")
            );
        }
    }
    Ok(Outcome::Passed)
}

/// Compiles the library of a package as a program for the browser; `None` where there is no compiler.
pub(crate) fn build_program(package: &str) -> Result<Option<PathBuf>> {
    let Some(toolchain) = find_toolchain() else { return Ok(None) };
    let mut command = cargo_for(&toolchain, "rustc");
    command.args(["-p", package, "--lib", "--crate-type", "cdylib"]);
    shell::run(&mut command)?;
    let directory = match toolchain {
        Toolchain::Own => shell::target_dir(),
        Toolchain::Debian => debian_target_dir(),
    };
    let name = format!("{}.wasm", package.replace('-', "_"));
    Ok(Some(directory.join(TARGET).join("debug").join(name)))
}

/// Returns true if cargo says that one of the crates has warnings, as it does also where nothing was compiled
/// anew.
fn is_warned(line: &str) -> bool {
    let rest = line.strip_prefix("warning: `").and_then(|rest| rest.split_once('`'));
    rest.is_some_and(|(name, rest)| CRATES.contains(&name) && rest.contains("generated"))
}

/// What is there already comes first, then what rustup brings, then what apt brings.
fn find_toolchain() -> Option<Toolchain> {
    let own = || has_own_target().then_some(Toolchain::Own);
    let debian = || has_debian_toolchain().then_some(Toolchain::Debian);
    own()
        .or_else(debian)
        .or_else(|| {
            println!("adding the target {TARGET}: the crates of the browser are compiled for it");
            shell::run(shell::command("rustup").args(["target", "add", TARGET])).ok().and_then(|()| own())
        })
        .or_else(|| {
            println!("installing Debian's Rust compiler with its sources: rustup has no {TARGET} here");
            setup::install(DEBIAN_PACKAGES).ok().and_then(|()| debian())
        })
}

fn has_own_target() -> bool {
    let mut rustc = shell::command("rustc");
    let libraries = shell::output(rustc.args(["--print", "target-libdir", "--target", TARGET]));
    libraries.is_ok_and(|directory| Path::new(directory.trim()).is_dir())
}

fn has_debian_toolchain() -> bool {
    linker().is_some()
        && Path::new(DEBIAN_SOURCES).is_dir()
        && shell::succeeds(Command::new(DEBIAN_RUSTC).arg("-V"))
}

fn linker() -> Option<&'static str> {
    ["wasm-ld-22", "wasm-ld"].into_iter().find(|name| shell::on_path(name))
}

/// The two compilers would overwrite each other's results.
fn debian_target_dir() -> PathBuf {
    shell::target_dir().join("wasm")
}

fn cargo_for(toolchain: &Toolchain, subcommand: &str) -> Command {
    let mut command = shell::cargo(subcommand);
    command.args(["--target", TARGET]).args(NOT_OPTIMISED);
    // What it says is read here, whatever the terminal shows.
    command.env("CARGO_TERM_COLOR", "never");
    // Lints are those of the native code.
    command.env_remove(once::WRAPPER);
    if let Toolchain::Debian = toolchain {
        command.arg("--target-dir").arg(debian_target_dir());
        command.arg("-Zbuild-std=std,panic_abort").env("RUSTC", DEBIAN_RUSTC).env("RUSTC_BOOTSTRAP", "1");
        command.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", linker().unwrap_or("wasm-ld"));
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cargo_says_has_no_colours_that_would_hide_warnings() {
        let command = cargo_for(&Toolchain::Own, "check");
        let mut set = command.get_envs().filter(|(name, _)| *name == "CARGO_TERM_COLOR");
        assert!(set.next().is_some_and(|(_, colour)| colour.is_some_and(|colour| colour == "never")));
    }

    #[test]
    fn a_crate_with_warnings_is_told_from_others_and_from_the_warnings_themselves() {
        assert!(is_warned(
            "warning: `vastex` (lib) generated 4 warnings (run `cargo fix` to apply 1 suggestion)"
        ));
        assert!(is_warned("warning: `vastex-wgpu` (lib) generated 1 warning"));
        assert!(
            !is_warned("warning: `other` (lib) generated 4 warnings")
                && !is_warned("warning: unused variable: `vastex`")
        );
    }
}
