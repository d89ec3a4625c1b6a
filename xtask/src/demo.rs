//! `cargo xtask demo`: the real Earth from `assets/` as a virtual texture, to look at.
//!
//! In a window where there is a display, else as two pictures. All of it is the program `vastex`, called as a person
//! would call it.

use std::process::Command;

use anyhow::{Context, Result};

use crate::{demo_program, setup, shell};

const PROGRAM: &str = "vastex-cli";
const IMAGE: &str = "assets/earth-color-10800x5400.jpg";
const CONTAINER: &str = "target/demo/earth.vastex";

/// A picture for machines without a display: what it shows, its file, and what `vastex render` is told.
const PICTURES: &[(&str, &str, &[&str])] = &[
    ("the globe from space", "target/demo/globe.png", &[]),
    ("a close-up", "target/demo/closeup.png", &["--camera-path", "zoom"]),
];

pub(crate) fn run() -> Result<()> {
    let has_display = has_display();
    println!("{}", plan(has_display));
    setup::ensure(&setup::C_COMPILER)?;
    setup::ensure_if_possible(&setup::NASM);
    setup::ensure(&setup::GRAPHICS_DRIVER)?;
    std::fs::create_dir_all(shell::root().join("target/demo")).context("cannot create target/demo")?;
    println!("\n1. compiling the program, unless it is compiled already");
    let mut compile = shell::cargo("build");
    shell::run(compile.args(["-p", PROGRAM]).args(demo_program::features(has_display)))?;
    println!("\n2. making the container");
    // The Earth goes round, so its left and right edges are neighbours.
    shell::run(vastex().args(["build", IMAGE, "-o", CONTAINER, "--address", "wrap,clamp"]))?;
    if has_display {
        println!("\n3. opening the window; close it to end");
        match shell::run(vastex().args(["view", CONTAINER, "--on", "globe"])) {
            Ok(()) => return Ok(()),
            Err(error) => println!("{error:#}\nno window could be opened, so pictures are drawn instead"),
        }
    }
    println!("\n3. drawing the pictures");
    render()
}

/// What will happen, and how long it takes.
fn plan(has_display: bool) -> String {
    let shown = match has_display {
        true => "3. opens a window with it on a globe: drag turns it, the wheel zooms",
        false => "3. draws two pictures of it, since there is no display here: some seconds",
    };
    format!(
        "This shows {IMAGE} as a virtual texture. It\n\
         1. compiles the program: about 5 minutes on two processor cores the first time, at once from then on\n\
         2. makes the container {CONTAINER} of the image: some seconds\n{shown}\n"
    )
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

/// The program, compiled by the same profile as in the suite, so that neither compiles libraries that the other has compiled.
pub(crate) fn vastex() -> Command {
    let program = shell::target_dir().join("debug").join(format!("vastex{}", std::env::consts::EXE_SUFFIX));
    shell::command(&program.to_string_lossy())
}

fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    cfg!(any(target_os = "macos", windows)) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}
