//! Windows that open, draw some frames of what they are to show, and end by themselves.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Result, ensure};

use super::display::Display;
use super::{hands, program};
use crate::shell;

/// Opened for the first time: a person's hands have built the other one before.
const IMAGE: &str = "assets/earth-elevation-1080x540-u16.png";
const VOLUME: &str = "assets/volumes/head.zip";
/// Frames of the source itself.
const FRAMES: &str = "4";
/// A window that is quick to draw.
const SIZE: &str = "240x160";

/// Opens a container, images that nobody built, one that ends early, and heights of a file of their own.
pub(super) fn check(place: &Path) -> Result<()> {
    let display = Display::start(place)?;
    let container = place.join("image.vastex");
    let mut build = shell::command(&program().to_string_lossy());
    shell::run(build.args(["build", IMAGE, "--quiet", "-o"]).arg(&container))?;
    what_goes_wrong(&display, place, &container)?;
    images_that_nobody_built(&display, place)?;
    heights_of_a_file(&display, place)
}

/// A container is shown, and the window goes on without its device, without its surface, and where the
/// surface is refused for a frame; each time a line says so, and none tells of an error. Of a volume that is
/// being read nothing is left out.
fn what_goes_wrong(display: &Display, place: &Path, container: &Path) -> Result<()> {
    let lost = "the graphics device was lost; going on with a new one";
    for (source, scene, fault, line) in [
        (container, &["--on", "image"][..], "device", lost),
        (container, &["--on", "globe"], "surface", "is asked again: its surface was lost"),
        (container, &[], "configuration", "is asked again: Validation Error"),
        (Path::new(VOLUME), &[], "device", lost),
    ] {
        let mut command = view(display, place, source);
        let said = shell::run_with_stderr(command.args(scene).args(["--fault", fault]))?;
        let is_told = said.iter().any(|told| told.starts_with("vastex: ") && told.contains(line));
        let has_errors = said.iter().any(|told| told.starts_with("vastex: error"));
        ensure!(is_told && !has_errors, "a window with a fault, {fault}: {said:?}");
    }
    Ok(())
}

/// A PNG is shown while it is built, and opened at once the second time, as a JPEG is that was built before;
/// of one that ends early, the program says so.
fn images_that_nobody_built(display: &Display, place: &Path) -> Result<()> {
    for (image, scene, is_built) in
        [(IMAGE, "image", true), (IMAGE, "image", false), (hands::PLANET, "globe", false)]
    {
        let said = shell::run_with_stderr(view(display, place, Path::new(image)).args(["--on", scene]))?;
        ensure!(
            hands::says_built(&said.join("\n")) == is_built,
            "{image}: built the first time and no other: {said:?}"
        );
    }
    let short = place.join("short.png");
    let whole = fs::read(shell::root().join(IMAGE))?;
    fs::write(&short, &whole[..whole.len() / 2])?;
    let ended = view(display, place, &short).output()?;
    let said = String::from_utf8_lossy(&ended.stderr);
    ensure!(
        ended.status.code() == Some(1) && said.contains("short.png: is truncated"),
        "an image that ends early: {:?}, {said}",
        ended.status
    );
    Ok(())
}

/// Heights of a file of their own come after what they displace, which is shown without them until then.
fn heights_of_a_file(display: &Display, place: &Path) -> Result<()> {
    for scene in ["terrain", "globe", "planet"] {
        let mut command = view(display, place, Path::new(IMAGE));
        let said = shell::run_with_stderr(command.args(["--on", scene, "--height", IMAGE]))?;
        let errors: Vec<_> = said.iter().filter(|line| line.contains("error")).collect();
        ensure!(errors.is_empty(), "heights on a {scene}: {errors:?}");
    }
    Ok(())
}

/// A window that closes after some frames of what it is to show, once all of it is there.
fn view(display: &Display, place: &Path, source: &Path) -> Command {
    let mut command = shell::command(&program().to_string_lossy());
    hands::stand_in(&mut command, display, place);
    command.arg("view").arg(source).args(["--size", SIZE, "--exit-after-frames", FRAMES]);
    command
}
