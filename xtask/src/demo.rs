//! `cargo xtask demo`: the real Earth from `assets/` as a virtual texture, to look at.
//!
//! In a window where there is a display, else as two pictures. All of it is the program `vastex`, called as a
//! person would call it.

use std::process::Command;

use anyhow::{Context, Result};

use crate::{demo_program, setup, shell};

const PROGRAM: &str = "vastex-cli";
/// The images of the Earth, and the containers that are made of them: colours, heights, lights at night and
/// clouds.
const IMAGES: [(&str, &str); 4] = [
    ("assets/earth-color-10800x5400.jpg", "target/demo/earth.vastex"),
    ("assets/earth-land-4320x2160-u16.png", "target/demo/land.vastex"),
    ("assets/earth-night-2048x1024.jpg", "target/demo/night.vastex"),
    ("assets/earth-clouds-2048x1024.jpg", "target/demo/clouds.vastex"),
];
/// The Earth of these containers: values of its heights are metres, and a map has paler colours than a
/// planet.
const PLANET: &[&str] = &[
    "target/demo/earth.vastex",
    "--on",
    "planet",
    "--layer",
    ":gamma=1.4",
    "--height",
    "target/demo/land.vastex",
    "--height-scale",
    "0.010286",
    "--height-zero",
    "0",
    "--night",
    "target/demo/night.vastex",
    "--clouds",
    "target/demo/clouds.vastex",
];

/// A picture for machines without a display: what it shows, its file, and what `vastex render` is told.
const PICTURES: &[(&str, &str, &[&str])] = &[
    (
        "the Earth from space",
        "target/demo/planet.png",
        &["--sun", "-52,14", "--view", "globe:lon=22,lat=27,alt=7500000m"],
    ),
    (
        "the Alps",
        "target/demo/alps.png",
        &["--sun", "-30,35", "--exaggeration", "6", "--view", "globe:lon=9,lat=36,alt=1000000m,tilt=42"],
    ),
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
    println!("\n2. making the containers");
    for (image, container) in IMAGES {
        // The Earth goes round, so its left and right edges are neighbours.
        shell::run(vastex().args(["build", image, "-o", container, "--address", "wrap,clamp"]))?;
    }
    if has_display {
        println!("\n3. opening the window; close it to end");
        match shell::run(vastex().arg("view").args(PLANET)) {
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
        true => {
            "3. opens a window with it: drag turns it, the wheel zooms, Ctrl and drag tilts, ? lists the rest"
        }
        false => "3. draws two pictures of it, since there is no display here: some seconds",
    };
    let [(image, container), ..] = IMAGES;
    format!(
        "This shows the Earth of {image} and three more images as virtual textures. It\n\
         1. compiles the program: about 3 minutes on two processor cores the first time, at once from then on\n\
         2. makes {container} and the containers of the others: some seconds\n{shown}\n"
    )
}

fn render() -> Result<()> {
    for (_, file, options) in PICTURES {
        let mut command = vastex();
        command.arg("render").args(PLANET).args(["--size", "1280x720", "--pool-mib", "64"]);
        shell::run(command.args(*options).args(["--until-converged", "-o", file]))?;
    }
    println!();
    for (what, file, _) in PICTURES {
        println!("{what}: {}", shell::root().join(file).display());
    }
    Ok(())
}

/// The program, compiled by the same profile as in the suite, so that neither compiles libraries that the
/// other has compiled.
pub(crate) fn vastex() -> Command {
    let program = shell::target_dir().join("debug").join(format!("vastex{}", std::env::consts::EXE_SUFFIX));
    shell::command(&program.to_string_lossy())
}

fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    cfg!(any(target_os = "macos", windows)) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}
