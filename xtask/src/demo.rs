//! `cargo xtask demo`: the real Earth from `assets/` as a virtual texture, to look at.
//!
//! In a window where there is a display, else as two pictures. All of it is the program `vastex`, called as a person
//! would call it.

use std::process::Command;

use anyhow::{Context, Result};

use crate::{setup, shell};

const IMAGE: &str = "assets/earth-color-10800x5400.jpg";
const CONTAINER: &str = "target/demo/earth.vastex";

/// A picture for machines without a display: what it shows, its file, and what `vastex render` is told.
const PICTURES: &[(&str, &str, &[&str])] = &[
    ("the globe from space", "target/demo/globe.png", &[]),
    ("a close-up", "target/demo/closeup.png", &["--camera-path", "zoom"]),
];

pub(crate) fn run() -> Result<()> {
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    std::fs::create_dir_all(shell::root().join("target/demo")).context("cannot create target/demo")?;
    println!("\nbuilding the program (some minutes the first time), then the container from the real image");
    // The Earth goes round, so its left and right edges are neighbours.
    shell::run(vastex().args(["build", IMAGE, "-o", CONTAINER, "--address", "wrap,clamp"]))?;
    if has_display() {
        println!("\nopening the window; close it to end");
        match shell::run(vastex().args(["view", CONTAINER, "--on", "globe"])) {
            Ok(()) => return Ok(()),
            Err(error) => println!("{error:#}\nno window could be opened; rendering pictures instead"),
        }
    }
    render()
}

fn render() -> Result<()> {
    for (_, file, options) in PICTURES {
        let mut command = vastex();
        command.args(["render", CONTAINER, "--on", "globe", "--size", "1280x720", "--pool-mib", "64"]);
        shell::run(command.args(*options).args(["--until-converged", "-o", file]))?;
    }
    println!();
    for (what, file, _) in PICTURES {
        println!("{what}: {}", shell::root().join(file).display());
    }
    Ok(())
}

/// The program, in the same profile as the suite, so that neither compiles what the other has compiled.
fn vastex() -> Command {
    let mut command = shell::cargo("run");
    command.args(["-p", "vastex-cli", "--"]);
    command
}

fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    cfg!(any(target_os = "macos", windows)) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}
