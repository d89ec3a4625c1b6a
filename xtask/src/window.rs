//! The step that opens the program's window, on a display that is none.
//!
//! What the window shows is drawn by the same code as the pictures, which the tests compare; here it is
//! opened, redrawn and closed, with containers and with images that nobody built, and used by keys and
//! pointer (`hands`), with a volume in it as well, and with a picture of every step of that in
//! `target/window/steps` and `target/window/volume/steps`. Where there is no
//! virtual display the step is skipped, loudly.

mod display;
mod hands;
mod png;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

use crate::outcome::Outcome;
use crate::{setup, shaders, shell};

const IMAGE: &str = "assets/earth-elevation-1080x540-u16.png";
const JPEG: &str = "assets/earth-color-10800x5400.jpg";
const VOLUME: &str = "assets/volumes/head.zip";
const FRAMES: &str = "40";

pub(crate) fn check() -> Result<Outcome> {
    if !cfg!(target_os = "linux") {
        return Ok(Outcome::Skipped("virtual displays are looked for on Linux only".to_owned()));
    }
    if let Err(error) = setup::ensure(&setup::VIRTUAL_DISPLAY) {
        println!("\n!!!! SKIPPED: {error:#}, so nothing says whether the window still opens !!!!\n");
        return Ok(Outcome::Skipped("no virtual display".to_owned()));
    }
    // The program as its tests have it: asked for by itself it would be compiled anew, with fewer features.
    shell::run(shell::cargo("test").args(["--quiet", "--workspace", "--test", "program", "--no-run"]))?;
    let place = shell::target_dir().join("window");
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    fs::create_dir_all(&place)?;
    let container = place.join("image.vastex");
    let mut build = shell::command(&program().to_string_lossy());
    shell::run(build.args(["build", IMAGE, "--quiet", "-o"]).arg(&container))?;
    for scene in ["image", "globe"] {
        shell::run(view(&place, &container).args(["--on", scene]))?;
    }
    images_that_nobody_built(&place)?;
    heights_of_a_file(&place)?;
    hands::use_window(&place, &program(), &shell::root().join(IMAGE))?;
    hands::use_volume(&place, &program(), &shell::root().join(VOLUME))?;
    Ok(Outcome::Passed)
}

/// A JPEG and a PNG are shown while they are built, and opened at once the second time; of one that ends
/// early, the program says so.
fn images_that_nobody_built(place: &Path) -> Result<()> {
    for image in [JPEG, IMAGE] {
        for is_built in [true, false] {
            let said = shell::run_with_stderr(&mut view(place, Path::new(image)))?;
            ensure!(
                said.iter().any(|line| line.contains("is built into")) == is_built,
                "{image}: built the first time and no other: {said:?}"
            );
        }
    }
    let short = place.join("short.png");
    let whole = fs::read(shell::root().join(IMAGE))?;
    fs::write(&short, &whole[..whole.len() / 2])?;
    let ended = view(place, &short).output()?;
    let said = String::from_utf8_lossy(&ended.stderr);
    ensure!(
        ended.status.code() == Some(1) && said.contains("short.png: is truncated"),
        "an image that ends early: {:?}, {said}",
        ended.status
    );
    Ok(())
}

/// Heights of a file of their own come after what they displace, which is shown without them until then.
fn heights_of_a_file(place: &Path) -> Result<()> {
    for scene in ["terrain", "globe", "planet"] {
        let mut command = view(place, Path::new(IMAGE));
        let said = shell::run_with_stderr(command.args(["--on", scene, "--height", IMAGE]))?;
        let errors: Vec<_> = said.iter().filter(|line| line.contains("error")).collect();
        ensure!(errors.is_empty(), "heights on a {scene}: {errors:?}");
    }
    Ok(())
}

/// A window on a virtual display, which closes after some frames of what it is to show.
fn view(place: &Path, source: &Path) -> Command {
    let mut command = shell::command("xvfb-run");
    command.env(shaders::LOG, shaders::handed_over());
    command.env("XDG_CACHE_HOME", place.join("cache")).env("XDG_STATE_HOME", place.join("state"));
    command.args(["-a", "-s", "-screen 0 1280x800x24"]).arg(program()).arg("view").arg(source);
    command.args(["--exit-after-frames", FRAMES]);
    command
}

fn program() -> PathBuf {
    shell::target_dir().join("debug/vastex")
}
